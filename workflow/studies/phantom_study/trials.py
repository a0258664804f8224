"""Make one trial of the phantom's calibration, and measure its difference from the paper."""

import json
from collections.abc import Mapping, Sequence

import numpy as np

from capsule.phantom.parameters import Phantom, with_values
from phantom_study import paper_table
from phantom_study.paper_table import PaperTable
from phantom_study.simulated_archive import DetectorSettings, simulate_and_judge

# Smallest spread, in points. With 20 runs, a rate changes in steps of 5 points, so a mean that is
# closer than this fits.
_LEAST_SPREAD = 1.5


def try_out(
    phantom: Phantom,
    detector: DetectorSettings,
    paper: PaperTable,
    values: Mapping[str, float],
    seed: int,
) -> dict:
    """Simulate one archive with as many runs as in the paper, and judge it as in the paper.

    Parameters
    ----------
    phantom, detector, paper
        Inputs that all trials share.
    values
        The candidate's parameters, by ``part.parameter``.
    seed
        Seed of the archive.

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
        A trial from `try_out`; its numbers may be text, as in a file.
    paper
        Names of the cells and of the motion.
    """
    motion = {name: float(trial[name]) for name in paper.motion}
    return paper_table.cells(np.array(json.loads(trial["confusion"])), paper) | motion


def mean_distance(trials: Sequence[Mapping], paper: PaperTable) -> float:
    """Return the distance of the means of a candidate's trials from the paper, in spreads."""
    rates = [trial_rates(trial, paper) for trial in trials]
    means = {name: float(np.mean([each[name] for each in rates])) for name in rates[0]}
    return paper_table.distance(means, paper)


def shortfall(trials: Sequence[Mapping], paper: PaperTable) -> tuple[float, float]:
    """Return a candidate's differences from the paper over several archives.

    Parameters
    ----------
    trials
        Trials from `try_out`, or from a file.
    paper
        The paper's table.

    Returns
    -------
    worst : float
        Difference of the paper from the mean in the worst cell, in standard deviations of the
        archives. If it is well below 2, the paper's value lies inside the central 95 %.
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
