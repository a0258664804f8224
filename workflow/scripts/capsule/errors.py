"""The errors that a user can cause."""


class CapsuleError(Exception):
    """A fault in what the user gave; its text names the place, the value and the remedy."""


class RecordingError(CapsuleError):
    """A recording that cannot be used; its text is the reason listed in recordings.csv."""
