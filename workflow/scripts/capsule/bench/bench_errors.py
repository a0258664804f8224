"""The errors of recording and surveys, each with its own exit status."""

from capsule.errors import CapsuleError


class AcquisitionError(CapsuleError):
    """A fault at the bench; `status` is the exit status of the command."""

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
