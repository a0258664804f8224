"""One trial of the phantom's calibration, and how far a candidate's trials are from the paper."""

import json
from collections.abc import Mapping, Sequence

import numpy as np

from capsule.phantom.parameters import Phantom, with_values
from phantom_study import paper_table
from phantom_study.paper_table import PaperTable
from phantom_study.simulated_archive import DetectorSettings, simulate_and_judge

# In points. Twenty runs move a rate by 5 at a time: a mean that is nearer than this fits.
_LEAST_SPREAD = 1.5


def try_out(
    phantom: Phantom,
    detector: DetectorSettings,
    paper: PaperTable,
    values: Mapping[str, float],
    seed: int,
) -> dict:
    """Simulate one archive with as many runs as the paper's, and judge it as the paper does.

    Parameters
    ----------
    phantom, detector, paper
        What all trials share.
    values
        The candidate's parameters, by ``part.parameter``.
    seed
        Of the archive.

    Returns
    -------
    dict
        ``archive_seed``, ``confusion`` (JSON), the motion and the values.
    """
    candidate = with_values(phantom, values)
    confusion, motion = simulate_and_judge(candidate, detector, paper, paper.runs, seed)
    result = {"archive_seed": seed, "confusion": json.dumps(confusion.tolist())}
    return result | motion | dict(values)


def trial_rates(trial: Mapping, paper: PaperTable) -> dict[str, float]:
    """Return the cells and the motion of a trial, in percent.

    Parameters
    ----------
    trial
        From `try_out`; its numbers may be text, as in a file.
    paper
        Names the cells and the motion.
    """
    motion = {name: float(trial[name]) for name in paper.motion}
    return paper_table.cells(np.array(json.loads(trial["confusion"])), paper) | motion


def mean_distance(trials: Sequence[Mapping], paper: PaperTable) -> float:
    """Return how far the means of some trials of a candidate are from the paper, in spreads."""
    rates = [trial_rates(trial, paper) for trial in trials]
    means = {name: float(np.mean([each[name] for each in rates])) for name in rates[0]}
    return paper_table.distance(means, paper)


def shortfall(trials: Sequence[Mapping], paper: PaperTable) -> tuple[float, float]:
    """Return how far a candidate is from the paper over several archives.

    Parameters
    ----------
    trials
        From `try_out`, or from a file.
    paper
        What they should give.

    Returns
    -------
    worst : float
        By how many standard deviations of the archives the paper lies off the mean of the cell
        that fits worst. Where that is well below 2, the paper is inside the central 95 %.
    difference : float
        Mean absolute difference of the cells' means from the paper, in points.
    """
    rates = [trial_rates(trial, paper) for trial in trials]
    worst, differences = 0.0, []
    for name, printed in paper.cells.items():
        values = np.nan_to_num([each[name] for each in rates])
        difference = abs(values.mean() - printed)
        worst = max(worst, difference / max(values.std(), _LEAST_SPREAD))
        differences.append(difference)
    return float(worst), float(np.mean(differences))
