"""What a survey needs of a bench, be it boards, emulated boards or a simulation."""

from typing import Protocol

from acquisition.bench_errors import AcquisitionError
from capsule.survey.survey_log import Readings


class SurveyBench(Protocol):
    """Boards and capsule, as a survey sees them.

    Attributes
    ----------
    at_end : bool
        Whether the capsule has arrived at the end of the gut.
    trouble : AcquisitionError or None
        Why the survey cannot go on; it then ends with an unfolded origami.
    index_mm : float or None
        Phase of the wave at the cam shaft's index, by which a later session knows the wave's phase;
        None before the shaft has passed it.
    """

    @property
    def at_end(self) -> bool:
        """See above."""

    @property
    def trouble(self) -> AcquisitionError | None:
        """See above."""

    @property
    def index_mm(self) -> float | None:
        """See above."""

    def tell(self, command: str) -> None:
        """Give the boards a command of `capsule.survey.cycle`; returns at once."""

    def read(self, samples: int) -> Readings:
        """Wait for the next samples; what does not come in time is missing.

        Raises
        ------
        AcquisitionError
            There was not even a first sample.
        """

    def leave(self) -> list[str]:
        """Unfold the origami, stop the wave and let go of the boards; gives warnings.

        Whatever has happened: it may be called at any time, and more than once.
        """
