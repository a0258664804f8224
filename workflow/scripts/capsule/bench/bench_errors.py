"""The errors of recording and surveys, each with its own exit status."""

from capsule.errors import CapsuleError


class AcquisitionError(CapsuleError):
    """A fault at the bench; `status` is the exit status of the command."""

    status = 1

    def __init_subclass__(cls, status: int) -> None:
        """Give a kind of fault its exit status."""
        cls.status = status


class BoardNotFoundError(AcquisitionError, status=3):
    """A board that was not found, or several boards that fit."""


class NoAnswerError(AcquisitionError, status=4):
    """A port that opens but does not answer."""


class PortBusyError(AcquisitionError, status=5):
    """A port that another program uses."""


class NoPermissionError(AcquisitionError, status=6):
    """A port that the user has no permission to open."""


class WrongBaudError(AcquisitionError, status=7):
    """A port that sends bytes but no frames."""


class WrongBoardError(AcquisitionError, status=8):
    """An answer from another board, another program or another protocol."""


class DiskFullError(AcquisitionError, status=9):
    """A disk that is full."""


class NameExistsError(AcquisitionError, status=10):
    """A name that a recording or session already has; neither is ever overwritten."""


class BoardLostError(AcquisitionError, status=11):
    """A board that was lost and did not come back in time; earlier samples are kept."""


class RefusedError(AcquisitionError, status=12):
    """A command that a board refuses."""


class CannotArriveError(AcquisitionError, status=13):
    """A target that the capsule did not reach."""


class SurveyFaultError(AcquisitionError, status=14):
    """An origami that did not fold or unfold as commanded."""


class LineLostError(Exception):
    """An open port that disappeared; the session waits for it to come back."""
