"""Configuration, keys, locks, and the start and end of a run."""
