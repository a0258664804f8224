"""A survey: the capsule goes back to suspected places and senses them again."""
