"""Measure how the detector's rates change if the bench changes after the templates were made."""

import functools
from collections.abc import Iterator, Sequence

import numpy as np

from capsule.phantom.parameters import Phantom, value_of, with_values
from capsule.seeding import generator
from phantom_study.paper_table import PaperTable, cells
from phantom_study.simulated_archive import (
    SIZES_MM,
    DetectorSettings,
    archive_matrices,
    classify,
    learn,
    simulate_archive,
)

# The parameters of each disturbance, and the factors by which its levels multiply them; 1 is the
# calibrated bench.
VARIATIONS = {
    "noise": (("sensor.noise",), (0, 1, 4, 8, 16, 32)),
    "drift": (("sensor.drift_per_s", "sensor.settling"), (0, 0.25, 0.5, 1, 2, 4)),
    "speed": (("advance.speed_mm_s",), (0.7, 0.85, 1, 1.25, 1.5, 2)),
    "contact variation": (
        (
            "contact.coupling_spread",
            "contact.series_offset_mm",
            "contact.height_offset_mm",
            "contact.wander_mm",
            "wall.unevenness_mm",
        ),
        (0, 0.5, 1, 1.5, 2, 3),
    ),
}
# Name of the disturbance whose levels are `FAULTS`.
FAULTY = "one faulty sensor"
FAULTS = ("none", "dead", "saturated")
# Seed of the archive that makes the templates, and first seed of the archives that are classified.
_TEMPLATE_SEED, _FIRST_SEED = 1, 1001


def varied(phantom: Phantom, parameters: Sequence[str], level: float) -> Phantom:
    """Return the phantom with some parameters at a multiple of their calibrated values."""
    return with_values(phantom, {name: level * value_of(phantom, name) for name in parameters})


def with_fault(
    counts: np.ndarray, fault: str, sensor: int, numbers: np.random.Generator
) -> np.ndarray:
    """Return the readings of a run with a fault in one sensor.

    Parameters
    ----------
    counts : (S, K) array of int
        Readings of a sound run.
    fault
        One of three words. ``none``: no fault. ``dead``: the sensor does not react to compression;
        only the last digit of the converter changes. ``saturated``: the reading does not fall
        below the sensor's median, so every firm compression is cut off.
    sensor
        Index of the faulty sensor, from 0.
    numbers
        Random numbers for the dead sensor's last digit.

    Returns
    -------
    (S, K) array of int

    Raises
    ------
    ValueError
        The fault is not one of `FAULTS`.
    """
    if fault not in FAULTS:
        raise ValueError(f"{fault!r} is not one of {', '.join(FAULTS)}")
    changed = counts.copy()
    middle = int(np.median(counts[sensor]))
    if fault == "dead":
        changed[sensor] = middle + numbers.integers(0, 2, counts.shape[1])
    elif fault == "saturated":
        changed[sensor] = np.maximum(counts[sensor], middle)
    return changed


def headline(confusion: np.ndarray, paper: PaperTable) -> dict[str, float]:
    """Return the rates that the sensitivity figure shows, in percent.

    Parameters
    ----------
    confusion : (6, 6) array of int
        Runs of true size (row) classified as size (column), 0..5 mm.
    paper
        The paper's table; exact and within-tolerance rates are averaged over its sizes.
    """
    rates = cells(confusion, paper)

    def mean_of(prefix: str) -> float:
        return float(np.mean([rate for name, rate in rates.items() if name.startswith(prefix)]))

    within = f"within {paper.tolerance_mm:g} mm"
    shown = {name: rates[name] for name in ("specificity", "recall 1 mm", "recall 2 mm")}
    return shown | {"exact size": mean_of("exact "), within: mean_of(within)}


def sweep(
    phantom: Phantom, detector: DetectorSettings, paper: PaperTable, archives: int, runs: int
) -> Iterator[dict]:
    """Yield the rates at every level of each disturbance, and with each kind of faulty sensor.

    Parameters
    ----------
    phantom
        The calibrated bench, on which the templates are made.
    detector, paper
        Settings of the detector, and the names of the rates.
    archives, runs
        Number of archives at each level, and of runs of each size in an archive.

    Yields
    ------
    dict
        ``variation``, ``level`` and the rates of `headline`.
    """
    first = archive_matrices(simulate_archive(phantom, _TEMPLATE_SEED, runs), detector)
    # A laboratory makes its templates once.
    templates = learn(first, detector)
    benches = [
        (name, level, varied(phantom, parameters, level), "none")
        for name, (parameters, levels) in VARIATIONS.items()
        for level in levels
    ]
    benches += [(FAULTY, fault, phantom, fault) for fault in FAULTS]
    for name, level, bench, fault in benches:
        confusion = np.zeros((len(SIZES_MM), len(SIZES_MM)), dtype=int)
        for seed in range(_FIRST_SEED, _FIRST_SEED + archives):
            spoil = functools.partial(_with_fault_by_chance, fault, seed)
            matrices = archive_matrices(simulate_archive(bench, seed, runs), detector, spoil)
            confusion += classify(matrices, templates)
        yield {"variation": name, "level": level} | headline(confusion, paper)


def _with_fault_by_chance(fault: str, seed: int, counts: np.ndarray, name: str) -> np.ndarray:
    """Return the readings of a run with a fault in a random sensor."""
    numbers = generator(seed, "fault", name)
    return with_fault(counts, fault, int(numbers.integers(len(counts))), numbers)
