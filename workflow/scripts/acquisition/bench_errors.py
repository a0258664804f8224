"""The ways in which recording fails, each with an exit status of its own."""

import contextlib
import sys
from collections.abc import Iterator

from capsule.errors import CapsuleError

INTERRUPTED = "interrupted before the recording began; nothing is archived"


class AcquisitionError(CapsuleError):
    """A fault at the bench; `status` is the exit status of acquire.py and survey.py."""

    status = 1


class BoardNotFoundError(AcquisitionError):
    """No port, or no board behind any port, or more than one that fits."""

    status = 3


class NoAnswerError(AcquisitionError):
    """The port opens but nothing speaks."""

    status = 4


class PortBusyError(AcquisitionError):
    """Another program has the port."""

    status = 5


class NoPermissionError(AcquisitionError):
    """The user may not open the port."""

    status = 6


class WrongBaudError(AcquisitionError):
    """Bytes come, but no frames."""

    status = 7


class WrongBoardError(AcquisitionError):
    """Something else answers: the other board, another program, another protocol."""

    status = 8


class DiskFullError(AcquisitionError):
    """Samples cannot be written."""

    status = 9


class NameExistsError(AcquisitionError):
    """There is a recording of that name; none is ever overwritten."""

    status = 10


class BoardLostError(AcquisitionError):
    """The board went away and did not come back in time; what came before is archived."""

    status = 11


class RefusedError(AcquisitionError):
    """A board will not do what it was asked."""

    status = 12


class CannotArriveError(AcquisitionError):
    """Folding does not bring the capsule back to where it should go."""

    status = 13


class SurveyFaultError(AcquisitionError):
    """The origami did not fold or unfold as it was told."""

    status = 14


class LineLostError(Exception):
    """The port went away while it was open; the session waits for it to come back."""


@contextlib.contextmanager
def end_with_status(interrupted: str = "") -> Iterator[None]:
    """End the program with the exit status of a fault at the bench, or with 130 at Ctrl-C.

    Parameters
    ----------
    interrupted : str
        What to say at Ctrl-C; nothing where the program has told it already.
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
