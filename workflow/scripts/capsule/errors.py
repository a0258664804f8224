"""Errors that a user can cause."""


class CapsuleError(Exception):
    """An error in the user's input; its text names the place, the value and the remedy."""


class RecordingError(CapsuleError):
    """The error of a recording that cannot be used; its text is the reason in recordings.csv."""
