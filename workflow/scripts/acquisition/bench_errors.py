"""The errors of recording and surveys, each with its own exit status."""

import contextlib
import sys
from collections.abc import Iterator

from capsule.errors import CapsuleError

INTERRUPTED = "interrupted before the recording began; nothing is archived"


class AcquisitionError(CapsuleError):
    """A fault at the bench; `status` is the exit status of acquire.py and survey.py."""

    status = 1


class BoardNotFoundError(AcquisitionError):
    """No port exists, no board is behind any port, or several boards fit."""

    status = 3


class NoAnswerError(AcquisitionError):
    """The port opens, but nothing answers."""

    status = 4


class PortBusyError(AcquisitionError):
    """Another program uses the port."""

    status = 5


class NoPermissionError(AcquisitionError):
    """The user has no permission to open the port."""

    status = 6


class WrongBaudError(AcquisitionError):
    """The port sends bytes but no frames."""

    status = 7


class WrongBoardError(AcquisitionError):
    """Another board, another program or another protocol answers."""

    status = 8


class DiskFullError(AcquisitionError):
    """The disk is full."""

    status = 9


class NameExistsError(AcquisitionError):
    """A recording or session of that name exists; it is never overwritten."""

    status = 10


class BoardLostError(AcquisitionError):
    """A board was lost and did not come back in time; the samples before that are kept."""

    status = 11


class RefusedError(AcquisitionError):
    """A board refuses a command."""

    status = 12


class CannotArriveError(AcquisitionError):
    """The capsule did not reach its target."""

    status = 13


class SurveyFaultError(AcquisitionError):
    """The origami did not fold or unfold as commanded."""

    status = 14


class LineLostError(Exception):
    """An open port disappeared; the session waits for it to come back."""


@contextlib.contextmanager
def end_with_status(interrupted: str = "") -> Iterator[None]:
    """End the program with the exit status of a fault at the bench, or with 130 at Ctrl-C.

    Parameters
    ----------
    interrupted : str
        Message at Ctrl-C; empty if the program has printed its own.
    """
    try:
        yield
    except AcquisitionError as error:
        print(f"error: {error}", file=sys.stderr)
        sys.exit(error.status)
    except KeyboardInterrupt:
        if interrupted:
            print(interrupted, file=sys.stderr)
        sys.exit(130)
