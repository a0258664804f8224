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
    """A board that was not found, or several boards that fit."""

    status = 3


class NoAnswerError(AcquisitionError):
    """A port that opens but does not answer."""

    status = 4


class PortBusyError(AcquisitionError):
    """A port that another program uses."""

    status = 5


class NoPermissionError(AcquisitionError):
    """A port that the user has no permission to open."""

    status = 6


class WrongBaudError(AcquisitionError):
    """A port that sends bytes but no frames."""

    status = 7


class WrongBoardError(AcquisitionError):
    """An answer from another board, another program or another protocol."""

    status = 8


class DiskFullError(AcquisitionError):
    """A disk that is full."""

    status = 9


class NameExistsError(AcquisitionError):
    """A name that a recording or session already has; neither is ever overwritten."""

    status = 10


class BoardLostError(AcquisitionError):
    """A board that was lost and did not come back in time; earlier samples are kept."""

    status = 11


class RefusedError(AcquisitionError):
    """A command that a board refuses."""

    status = 12


class CannotArriveError(AcquisitionError):
    """A target that the capsule did not reach."""

    status = 13


class SurveyFaultError(AcquisitionError):
    """An origami that did not fold or unfold as commanded."""

    status = 14


class LineLostError(Exception):
    """An open port that disappeared; the session waits for it to come back."""


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
