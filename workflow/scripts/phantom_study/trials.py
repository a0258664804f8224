"""One trial of the phantom's calibration, and which of several candidates comes nearest."""

import json
from collections.abc import Mapping, Sequence

import numpy as np

from capsule.phantom.parameters import Phantom, with_values
from capsule.seeding import generator
from phantom_study import paper_table, simulated_archive
from phantom_study.search import Cloud

# Archives of the search have seeds from here on; those that judge the winner count from 10 001.
FIRST_SEED = 100_000
_FINAL = 500
# In points. Twenty runs move a rate by 5 at a time: a mean that is nearer than this fits.
_LEAST_SPREAD = 1.5
# The second round's cloud of finalists, in parts of the first one's spread.
_CLOSER = 0.4


def generation_seeds(seed: int, generation: int, archives: int) -> list[int]:
    """Return the seeds of the archives that all candidates of a generation meet."""
    first = FIRST_SEED + 1000 * seed + generation * archives
    return list(range(first, first + archives))


def finalist_seeds(seed: int, final: int, archives: int) -> list[int]:
    """Return the seeds of the archives on which finalists meet; no generation has them."""
    first = FIRST_SEED + 1000 * seed + _FINAL + final * archives
    return list(range(first, first + archives))


def closer(cloud: Cloud, winner: np.ndarray) -> Cloud:
    """Return the cloud of the next round of finalists, around the winner of the last one."""
    return Cloud(winner, _CLOSER * cloud.spread)


def candidate_numbers(seed: int, generation: int) -> np.random.Generator:
    """Return the source of the candidates of one generation."""
    return generator(seed, "calibration", str(generation))


def try_out(
    phantom: Phantom, detector: simulated_archive.Detector, values: Mapping[str, float], seed: int
) -> dict:
    """Simulate one archive of 120 runs, and judge it as the paper does.

    Parameters
    ----------
    values
        The candidate's parameters, by ``part.parameter``.
    seed
        Of the archive.

    Returns
    -------
    dict
        ``archive_seed``, ``confusion`` (JSON), the motion and the values.
    """
    changed = with_values(phantom, values)
    archive = simulated_archive.simulate_archive(changed, seed, paper_table.RUNS)
    table = simulated_archive.resubstitution(
        simulated_archive.archive_matrices(archive, detector), detector
    )
    motion = simulated_archive.archive_motion(archive, changed)
    result = {"archive_seed": seed, "confusion": json.dumps(table.tolist())}
    return result | motion | dict(values)


def found_cells(row: Mapping) -> dict[str, float]:
    """Return the cells and the motion of a trial; its numbers may be text, as in a file."""
    motion = {name: float(row[name]) for name in paper_table.MOTION}
    return paper_table.cells(np.array(json.loads(row["confusion"]))) | motion


def mean_distance(trials: Sequence[Mapping]) -> float:
    """Return how far the means of some trials of a candidate are from the paper, in spreads."""
    found = [found_cells(row) for row in trials]
    means = {name: float(np.mean([each[name] for each in found])) for name in found[0]}
    return paper_table.distance(means)


def shortfall(trials: Sequence[Mapping]) -> tuple[float, float]:
    """Say how far a candidate is from the paper over several archives.

    Parameters
    ----------
    trials
        From `try_out`, or from a file.

    Returns
    -------
    worst : float
        By how many standard deviations of the archives the paper lies off the mean of the cell
        that fits worst. Where that is well below 2, the paper is inside the central 95 %.
    difference : float
        Mean absolute difference of the cells' means from the paper, in points.
    """
    found = [found_cells(row) for row in trials]
    worst, differences = 0.0, []
    for name, paper in paper_table.PAPER.items():
        values = np.nan_to_num([each[name] for each in found])
        difference = abs(values.mean() - paper)
        worst = max(worst, difference / max(values.std(), _LEAST_SPREAD))
        differences.append(difference)
    return float(worst), float(np.mean(differences))
