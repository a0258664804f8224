"""A simulated bench for surveys: a capsule in the simulated phantom, and its fold board."""

from collections.abc import Sequence
from typing import ClassVar

import numpy as np

from capsule.phantom.journey import Journey, Nodule
from capsule.phantom.parameters import Phantom
from capsule.phantom.simulation import simulated_header
from capsule.seeding import generator
from capsule.survey import cycle as cycles
from capsule.survey.survey_log import FOLDED, FOLDING, UNFOLDED, UNFOLDING, Readings

SOURCE = "simulated survey"
# Lease of a fold; each `hold` renews it.
LEASE_S = 5.0
_FULL = 1 - 1e-9
# Random numbers are drawn for a journey this many times as long as a straight one.
_DETOURS = 2.5
_AT_LEAST = 5000
# Distance of nodules from the ends of the gut, and from each other if there is room.
_FREE_MM = 60.0


class SimulatedBench:
    """Simulated boards and capsule in one, as `capsule.bench.survey_bench.BoardBench` has them.

    Attributes
    ----------
    head_mm : list of arrays
        True positions of the head at each sample.
    header : dict of str to str
        Header of the recordings.
    trouble, faults
        None: this bench has no faults.
    origami : str
        State of the origami, in words.
    index_mm
        0: the index passes when a crest is at the start of the gut.
    """

    trouble = None
    faults: ClassVar[list[str]] = []
    index_mm = 0.0

    def __init__(self, journey: Journey, rate_hz: float, header: dict[str, str]) -> None:
        self._journey, self._rate_hz = journey, rate_hz
        self.header = header
        self._lease_s = 0.0
        self.head_mm: list[np.ndarray] = []
        self.origami = ""

    @property
    def at_end(self) -> bool:
        """Return whether the capsule has reached the end, or the random numbers are used up."""
        return self._journey.at_end or self._journey.samples_left < 100

    def tell(self, command: str) -> None:
        """Send the boards a command."""
        match command:
            case cycles.FOLD:
                self._lease_s = LEASE_S
                self._journey.fold()
            case cycles.HOLD:
                self._lease_s = LEASE_S
            case cycles.UNFOLD:
                self._journey.unfold()
            case cycles.STOP_WAVE:
                self._journey.stop_wave()

    def read(self, samples: int) -> Readings:
        """Return the next samples."""
        self._lease_s -= samples / self._rate_hz
        if self._lease_s < 0:
            self._journey.unfold()
        stretch, counts = self._journey.advance(samples)
        self.head_mm.append(stretch.head_mm)
        fold = self._state(float(stretch.folded[0]), float(stretch.folded[-1]))
        self.origami = f"the origami is {fold}"
        return Readings(counts.astype(np.float64), stretch.wave_mm, fold)

    def _state(self, first: float, last: float) -> str:
        if self._journey.folding:
            return FOLDED if last >= _FULL else FOLDING
        return UNFOLDED if max(first, last) <= 0 else UNFOLDING


def bench_with(
    phantom: Phantom, *, seed: int, length_mm: float, nodules: list[Nodule], sensors: int
) -> SimulatedBench:
    """Return a bench with a gut of this length and these nodules."""
    rate_hz = phantom.electronics.rate_hz
    straight_s = length_mm / phantom.advance.speed_mm_s
    samples = int(_DETOURS * straight_s * rate_hz) + _AT_LEAST
    journey = Journey(phantom, seed, "survey", nodules, sensors, samples, length_mm)
    return SimulatedBench(journey, rate_hz, simulated_header(SOURCE, phantom, seed))


def nodules_of(seed: int, length_mm: float, diameters_mm: Sequence[float]) -> list[Nodule]:
    """Return nodules of these diameters at random places, or at even ones if room is short."""
    count = len(diameters_mm)
    room_mm = length_mm - _FREE_MM * (count + 1)
    places_mm = np.linspace(0, length_mm, count + 2)[1:-1]
    if room_mm >= 0:
        gaps_mm = np.sort(generator(seed, "survey", "nodules").uniform(0, room_mm, count))
        places_mm = gaps_mm + _FREE_MM * np.arange(1, count + 1)
    return [Nodule(*each) for each in zip(places_mm.tolist(), diameters_mm, strict=True)]
