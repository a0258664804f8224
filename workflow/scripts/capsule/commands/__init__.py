"""The command `capsule`."""
