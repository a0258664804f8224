"""Errors that a user can cause, and the line on each."""

import errno


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


def error_line(error: CapsuleError | OSError) -> str:
    """Return an error of the input or of the disk as one line."""
    if isinstance(error, CapsuleError):
        return f"error: {error}"
    remedy = ""
    if error.errno in (errno.ENOSPC, errno.EDQUOT):
        remedy = "; free some space and run again: finished results are kept"
    return f"error: {error.filename or 'disk'}: {error.strerror or error}{remedy}"
