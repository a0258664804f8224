"""Errors that a user can cause."""


class CapsuleError(Exception):
    """An error in the user's input; its text names the place, the value and the remedy.

    Attributes
    ----------
    status : int
        The exit status of a command that ends with this error.
    """

    status = 1


class RecordingError(CapsuleError):
    """The error of a recording that cannot be used; its text is the reason in recordings.csv."""


class WrongOptionError(CapsuleError):
    """Options of a command that contradict each other; a wrong value is argparse's own error."""

    status = 2
