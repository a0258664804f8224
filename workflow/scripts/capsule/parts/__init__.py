"""The parts that one makes: their design, what it refuses, their solids (these need manifold3d)."""
