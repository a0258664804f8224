"""Couple motor, wave, capsule and sensors to one bench.

The phantom is the simulator's (`capsule.phantom`): one run of the capsule along the gut. Here, the
wave is the phantom's clock. The phantom advances by the time that the wave has travelled, so it
stands still while the motor does.
"""

import numpy as np

from capsule.phantom.parameters import Phantom
from capsule.phantom.simulation import simulate_run
from support.bench.emulated import EmulatedBoard

# From docs/bench.md: half-steps of the motor for each mm of the wave, and the wave's speed.
HALF_STEPS_PER_MM = 64 * (32 / 9) * (22 / 11) * (26 / 9) * (31 / 10) / (3 * 80)


class ClosedLoop:
    """A world that couples a peristalsis board to a logger through the phantom.

    Parameters
    ----------
    phantom : Phantom
        The simulated bench.
    nodule_mm : float
        The nodule under the wall.
    seed : int
        The simulation's seed.
    motor, logger : EmulatedBoard
        The two boards.

    Attributes
    ----------
    progress_s : list of (float, float)
        Time of the bench and of the phantom, at the end of each stretch.
    """

    def __init__(
        self,
        phantom: Phantom,
        nodule_mm: float,
        seed: int,
        motor: EmulatedBoard,
        logger: EmulatedBoard,
    ) -> None:
        run = simulate_run(phantom, nodule_mm, seed, "closed loop")
        self.time_s, self.counts = run.time_s, run.counts
        electronics = phantom.electronics
        # Voltage in the middle of a step of the converter.
        self._voltages_mv = (run.counts + 0.5) * 1000 * electronics.vref_v / 2**electronics.adc_bits
        self._speed_mm_s = phantom.wall.speed_mm_s
        self._motor, self._logger = motor, logger
        self._phantom_s = 0.0
        self.progress_s: list[tuple[float, float]] = [(0.0, 0.0)]

    def __call__(self, start_s: float, end_s: float) -> None:
        """Move the capsule according to the motor's half-steps in the last stretch of time."""
        before_s = self._phantom_s
        travelled_mm = self._motor.half_steps / HALF_STEPS_PER_MM
        self._phantom_s = travelled_mm / self._speed_mm_s
        self._logger.set_voltages(self._at(before_s), self._at(self._phantom_s))
        self._logger.set_end_stop(self._phantom_s >= self.time_s[-1])
        self.progress_s.append((end_s, self._phantom_s))

    def _at(self, phantom_s: float) -> np.ndarray:
        return np.array([np.interp(phantom_s, self.time_s, sensor) for sensor in self._voltages_mv])

    def expected_counts(self, moments_s: np.ndarray) -> np.ndarray:
        """Return the counts (S, K) of the sensors at moments of the bench."""
        bench_s, phantom_s = np.array(self.progress_s).T
        moments_s = np.interp(moments_s, bench_s, phantom_s)
        return np.array([np.interp(moments_s, self.time_s, sensor) for sensor in self.counts])
