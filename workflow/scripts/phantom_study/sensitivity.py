"""How the detector bears a bench that changes after its templates were made."""

from collections.abc import Sequence

import numpy as np

from capsule.phantom.parameters import Phantom, value_of, with_values
from capsule.seeding import generator
from capsule.templates import TemplateSet
from phantom_study.paper_table import SIZES_MM
from phantom_study.simulated_archive import Detector, archive_matrices, classify, simulate_archive

# What is varied, and which parameters are multiplied by the level.
VARIATIONS: dict[str, tuple[str, ...]] = {
    "noise": ("sensor.noise",),
    "drift": ("sensor.drift_per_s", "sensor.settling"),
    "speed": ("advance.speed_mm_s",),
    "contact variation": (
        "contact.coupling_spread",
        "contact.series_offset_mm",
        "contact.height_offset_mm",
        "contact.wander_mm",
        "wall.unevenness_mm",
    ),
}
FAULTS = ("none", "dead", "saturated")


def varied(phantom: Phantom, variation: str, level: float) -> Phantom:
    """Return the phantom with one kind of disturbance at a multiple of its calibrated strength.

    Parameters
    ----------
    variation
        A key of `VARIATIONS`.
    level
        Factor on each of its parameters; 1 is the calibrated bench.
    """
    names = VARIATIONS[variation]
    return with_values(phantom, {name: level * value_of(phantom, name) for name in names})


def with_fault(
    counts: np.ndarray, fault: str, sensor: int, generator: np.random.Generator
) -> np.ndarray:
    """Return the readings of a run in which one sensor is faulty.

    Parameters
    ----------
    counts : (S, K) array of int
        Readings of a sound run.
    fault
        ``none``; ``dead``: the sensor no longer answers to compression and only the last digit
        of the converter moves; ``saturated``: everything below its middle reading, that is every
        firm compression, is cut off.
    sensor
        Index of the faulty sensor, from 0.
    generator
        Source of the dead sensor's last digit.

    Returns
    -------
    (S, K) array of int
    """
    if fault not in FAULTS:
        raise ValueError(f"{fault!r} is none of {', '.join(FAULTS)}")
    changed = counts.copy()
    middle = int(np.median(counts[sensor]))
    if fault == "dead":
        changed[sensor] = middle + generator.integers(0, 2, counts.shape[1])
    elif fault == "saturated":
        changed[sensor] = np.maximum(counts[sensor], middle)
    return changed


def measure(
    phantom: Phantom,
    detector: Detector,
    templates: TemplateSet,
    seeds: Sequence[int],
    fault: str = "none",
    runs: int = 20,
) -> np.ndarray:
    """Classify fresh archives of a bench with given templates and add their tables up.

    Parameters
    ----------
    phantom
        The bench, usually a `varied` one.
    templates
        From an archive of the calibrated bench: a lab makes its templates once.
    seeds
        One archive each.
    fault
        One of `FAULTS`; each run has another sensor at fault, chosen by chance.
    runs
        Runs of each size in an archive.

    Returns
    -------
    (6, 6) array of int
        Runs of true size (row) classified as size (column), 0..5 mm.
    """
    table = np.zeros((len(SIZES_MM), len(SIZES_MM)), dtype=int)
    for seed in seeds:

        def spoil(counts: np.ndarray, name: str, seed: int = seed) -> np.ndarray:
            numbers = generator(seed, "fault", name)
            return with_fault(counts, fault, int(numbers.integers(len(counts))), numbers)

        matrices = archive_matrices(simulate_archive(phantom, seed, runs), detector, spoil)
        table += classify(matrices, templates)
    return table


def headline(confusion: np.ndarray) -> dict[str, float]:
    """Return the rates that the sensitivity figure shows, in percent.

    Parameters
    ----------
    confusion : (6, 6) array
        Runs of true size (row) classified as size (column), 0..5 mm; exact and within-1-mm rates
        are over 2..5 mm, as in the paper.
    """
    share = 100 * confusion / confusion.sum(axis=1, keepdims=True)
    sizes = range(2, 6)
    return {
        "specificity": float(share[0, 0]),
        "recall 1 mm": float(100 - share[1, 0]),
        "recall 2 mm": float(100 - share[2, 0]),
        "exact size": float(np.mean([share[size, size] for size in sizes])),
        "within 1 mm": float(np.mean([share[size, size - 1 : size + 2].sum() for size in sizes])),
    }
