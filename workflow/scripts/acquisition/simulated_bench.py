"""A simulated bench for surveys: the phantom's journey, and a fold board that grants leases."""

import numpy as np

from capsule.phantom.journey import Journey
from capsule.survey import cycle as cycles
from capsule.survey.survey_log import FOLDED, FOLDING, UNFOLDED, UNFOLDING, Readings

# A fold is granted for so long, and each `hold` renews it.
LEASE_S = 5.0
_FULL = 1 - 1e-9


class SimulatedBench:
    """Boards and capsule in one.

    Parameters
    ----------
    journey : Journey
        The capsule in its gut.
    rate_hz : float
        Sampling rate.

    Attributes
    ----------
    head_mm : list of arrays
        The truth: where the head stood at each sample.
    """

    def __init__(self, journey: Journey, rate_hz: float) -> None:
        self._journey, self._rate_hz = journey, rate_hz
        self._lease_s = 0.0
        self._folding = False
        self.stopped = False
        self.head_mm: list[np.ndarray] = []

    @property
    def at_end(self) -> bool:
        """Whether the gut is over, or all that chance was drawn for."""
        return self._journey.at_end or self._journey.samples_left < 100

    def tell(self, command: str) -> None:
        """Give the boards a command."""
        match command:
            case cycles.FOLD:
                self._folding = True
                self._lease_s = LEASE_S
                self._journey.fold()
            case cycles.HOLD if self._folding:
                self._lease_s = LEASE_S
            case cycles.UNFOLD:
                self._let_go()
            case cycles.STOP_WAVE:
                self.stopped = True

    def read(self, samples: int) -> Readings:
        """Wait for the next samples."""
        if self._folding:
            self._lease_s -= samples / self._rate_hz
            if self._lease_s < 0:
                self._let_go()
        stretch = self._journey.advance(samples)
        self.head_mm.append(stretch.head_mm)
        return Readings(
            stretch.time_s,
            stretch.counts.astype(np.float64),
            stretch.wave_mm,
            self._state(float(stretch.folded[0]), float(stretch.folded[-1])),
        )

    def _let_go(self) -> None:
        self._folding = False
        self._journey.unfold()

    def _state(self, first: float, last: float) -> str:
        if self._folding:
            return FOLDED if last >= _FULL else FOLDING
        return UNFOLDED if max(first, last) <= 0 else UNFOLDING
