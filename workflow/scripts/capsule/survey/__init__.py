"""A survey: the capsule goes back to what it suspects and looks again."""
