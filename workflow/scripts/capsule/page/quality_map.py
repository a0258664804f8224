"""Measure the quality of each sensor, and show which recordings stand out, and by what."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from capsule import words
from capsule.arrays import FloatArray
from capsule.detectors.wave import Wave
from capsule.detectors.wave_traits import depths, log_odds, noises, wave_shares
from capsule.kinds import Cells, Row
from capsule.recordings.time_base import longest_gap

# From so many spreads of the archive on, a measure stands out; at this, its shade is darkest.
STANDS_OUT = 5.0
SHADES = 4
# Below this share at an end of the range, a sensor is more likely pressed hard than loose.
_LOOSE_FROM = 0.01


@dataclass(frozen=True)
class Measure:
    """A measure of a sensor: the head of its column, and what stands out, in words.

    The sign is 1 if a large value is bad, -1 if a small one is. Spreads of the archive below
    `least`, on the scale of `scaled`, do not matter.
    """

    title: str
    meaning: str
    sign: int
    least: float
    percent: bool = False

    def scaled(self, values: FloatArray) -> FloatArray:
        """Return values on a scale on which their deviations are alike in both directions."""
        if self.percent:
            return log_odds(values)
        logarithms: FloatArray = np.log(np.maximum(values, 0.001))
        return logarithms

    def text(self, value: float) -> str:
        """Return a value as its cell shows it."""
        return words.number(100 * value, 0) if self.percent else words.number(value, 2)


MEASURES = {
    "drift": Measure("Drift", "drifts", 1, 0.3),
    "noise": Measure("Noise", "is noisy", 1, 0.2),
    "rail": Measure("Rail %", "often reads an end of its range", 1, 0.5, percent=True),
    "wave": Measure("Wave %", "feels more than the wave", -1, 0.5, percent=True),
}


# The cell of what is not measured, and the quality of a recording that was rejected.
NO_CELL: Cells = {"value": None, "text": "", "shade": 0}
NOT_MEASURED: Cells = {"cells": [NO_CELL] * len(MEASURES), "remarks": []}


def sensor_measures(wave: Wave | None, at_ends: Sequence[float]) -> dict[str, list[float]]:
    """Return the measures of each sensor of a recording; without a wave, ``rail`` alone.

    ``drift`` is the change of the median level from the first half of the run to the second, and
    ``noise`` the mean second difference, both in depths of the sensor's wave; ``rail`` is the share
    of samples at an end of the range, and ``wave`` the share of power that belongs to the wave.
    """
    found = {"rail": np.asarray(at_ends, dtype=np.float64)}
    if wave is not None and (depth := depths(wave)).all():
        half = wave.level.shape[1] // 2
        first, second = wave.level[:, :half], wave.level[:, half:]
        change = np.abs(np.median(second, axis=1) - np.median(first, axis=1))
        found |= {"drift": change / depth, "noise": noises(wave) / depth, "wave": wave_shares(wave)}
    return {name: [float(f"{each:.3g}") for each in values] for name, values in found.items()}


def quality_cells(described: Mapping[str, Row]) -> dict[str, Cells]:
    """Return the cells of each recording's worst sensor, and a remark on each that stands out.

    The ``measures`` of each recording are from `sensor_measures`.
    """
    measured = {name: row["measures"] for name, row in described.items()}
    shown: dict[str, Cells] = {name: {"cells": [], "remarks": []} for name in measured}
    for key, measure in MEASURES.items():
        known = {name: np.array(of[key]) for name, of in measured.items() if of.get(key)}
        sensor = {name: int((measure.sign * of).argmax()) for name, of in known.items()}
        worst = np.array([known[name][number] for name, number in sensor.items()])
        deviations = _deviations(measure.sign * measure.scaled(worst), measure.least)
        shades = np.clip(deviations / STANDS_OUT * SHADES, 0, SHADES).astype(int).tolist()
        cells = {
            name: {"value": value, "text": measure.text(value), "shade": shade}
            for name, value, shade in zip(known, worst.tolist(), shades, strict=True)
        }
        for name, row in shown.items():
            cell = cells.get(name, NO_CELL)
            row["cells"].append(cell)
            if cell["shade"] == SHADES:
                row["remarks"].append(f"sensor {sensor[name] + 1} {measure.meaning}")
    return shown


def _deviations(scaled: FloatArray, least: float) -> FloatArray:
    """Return the deviations from the median, in robust standard deviations or ``least``."""
    from statistics import NormalDist  # for the page alone: each plot job imports this module

    if not scaled.size:
        return scaled
    deviations: FloatArray = scaled - np.median(scaled)
    # Not from scipy.stats: its import takes longer than the rest of the page.
    spread = float(np.median(np.abs(deviations))) / NormalDist().inv_cdf(0.75)
    return deviations / max(spread, least)


def quality_words(values: FloatArray, at_ends: Sequence[float], rate_hz: float) -> str:
    """Return the faults of an accepted recording in words; empty if it has none.

    Parameters
    ----------
    values : (S, K) array
        The readings on an even grid in time; NaN where a sample is missing.
    at_ends : sequence of S floats
        For each sensor, the largest share of its samples at one end of the ADC's range, from
        `capsule.recordings.units.shares_at_ends`.
    rate_hz : float
        Sampling rate.
    """
    faults = []
    _, longest = longest_gap(values)
    if longest:
        missing = float(np.isnan(values).all(axis=0).mean())
        faults.append(
            f"gaps: {words.percent(missing)} of the samples, the longest "
            f"{words.number(longest / rate_hz, 1)} s"
        )
    faults += [
        f"sensor {sensor} loose: at the end of its range in {words.percent(share)} of the samples"
        for sensor, share in enumerate(at_ends, start=1)
        if share >= _LOOSE_FROM
    ]
    return "; ".join(faults)
