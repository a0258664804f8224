"""Judge a recording by the detectors that have learned: whole, or in progress."""
