"""Parts of capsule and bench: design, checks, and solids (which need manifold3d)."""
