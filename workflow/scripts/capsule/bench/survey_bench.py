"""The interface between a survey and its bench: real boards, emulated boards or a simulation."""

from typing import Protocol

from capsule.bench.bench_errors import AcquisitionError
from capsule.survey.survey_log import Readings


class SurveyBench(Protocol):
    """Boards and capsule, as a survey sees them.

    Attributes
    ----------
    at_end : bool
        Whether the capsule has reached the end of the gut.
    trouble : AcquisitionError or None
        The fault that ends the survey; the origami is then unfolded.
    index_mm : float or None
        Phase of the wave at the cam shaft's index, from which a later session gets the phase; None
        before the shaft has passed the index.
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
        """Send the boards a command of `capsule.survey.cycle`, and return at once."""

    def read(self, samples: int) -> Readings:
        """Wait for the next samples; a late sample is missing.

        Raises
        ------
        AcquisitionError
            The first sample did not arrive.
        """

    def leave(self) -> list[str]:
        """Stop the wave, unfold the origami and close the ports; return warnings.

        It can be called at any time, also more than once.
        """
