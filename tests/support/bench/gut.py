"""Simulate a gut for surveys on boards: the motors move the wave and fold the capsule.

The phantom is the simulator's journey, and the wave is its clock. The phantom advances by a sample
each time the cams have carried the wave by the distance of a sample's time.
"""

from collections import deque
from collections.abc import Sequence
from typing import Protocol

import numpy as np

from capsule.phantom.journey import Chance, Journey, Nodule
from capsule.phantom.parameters import Phantom

_AT_ONCE = 8


class Motor(Protocol):
    """The motor that carries the wave."""

    cam_mm: float


class Thread(Protocol):
    """The thread that folds the origami; `folded` is the folded share, 0..1."""

    folded: float


class Converter(Protocol):
    """The board that takes the samples."""

    def set_voltages(self, from_mv: np.ndarray, to_mv: np.ndarray) -> None:
        """Set the analogue inputs to change evenly over the next stretch of time."""

    def set_end_stop(self, closed: bool) -> None:
        """Press or release the end stop."""


class Gut:
    """A world that couples three boards through a capsule in a gut.

    Parameters
    ----------
    phantom : Phantom
        The simulated bench.
    motor, thread, logger
        The boards.
    length_mm : float
        Place of the end stop, in mm.
    nodules : sequence of Nodule
        Nodules under the wall.
    seed : int
        The simulation's seed.

    Attributes
    ----------
    head_mm : float
        True place of the head, in mm.
    dead : dict of int to float
        Sensors that have died, and what they read, in counts.
    """

    def __init__(
        self,
        phantom: Phantom,
        motor: Motor,
        thread: Thread,
        logger: Converter,
        *,
        length_mm: float,
        nodules: Sequence[Nodule] = (),
        seed: int = 7,
    ) -> None:
        electronics = phantom.electronics
        samples = 12_000
        chance = Chance(phantom, seed, "survey", list(nodules), 4, samples)
        self._journey = Journey(phantom, chance, length_mm)
        self._step_mm = phantom.wall.speed_mm_s / electronics.rate_hz
        self._mv = 1000 * electronics.vref_v / 2**electronics.adc_bits
        self._motor, self._thread, self._logger = motor, thread, logger
        self._length_mm, self._cam_mm = length_mm, motor.cam_mm
        # Samples that the wave has not reached yet.
        self._ahead: deque[tuple[np.ndarray, float]] = deque()
        self._before, self.head_mm = self._sample()
        self._after, _ = self._sample()
        self._before_mm = 0.0
        self.dead: dict[int, float] = {}

    def __call__(self, start_s: float, end_s: float) -> None:
        """Move the capsule according to the motors in the last stretch of time."""
        del start_s, end_s
        way_mm = self._motor.cam_mm - self._cam_mm
        while way_mm > self._before_mm + self._step_mm:
            self._before_mm += self._step_mm
            self._before = self._after
            self._after, self.head_mm = self._sample()
        share = (way_mm - self._before_mm) / self._step_mm
        counts = self._before + share * (self._after - self._before)
        for sensor, count in self.dead.items():
            counts[sensor] = count
        # Voltage in the middle of a step of the converter.
        voltages_mv = (counts + 0.5) * self._mv
        self._logger.set_voltages(voltages_mv, voltages_mv)
        self._logger.set_end_stop(self.head_mm >= self._length_mm)

    def _sample(self) -> tuple[np.ndarray, float]:
        """Return the next counts, and the place of the head."""
        if not self._ahead:
            folded = self._thread.folded
            self._journey.bend(folded)
            # Several samples at once take less time, but not while the origami moves.
            stretch = self._journey.advance(_AT_ONCE if folded in (0.0, 1.0) else 1)
            self._ahead.extend(zip(stretch.counts.T.astype(float), stretch.head_mm, strict=True))
        return self._ahead.popleft()
