"""The stretches of a recording that raise the taught scorer's score.

One stretch after another is replaced by usual beats, on all sensors at once, and the recording is
scored again (occlusion, Zeiler and Fergus 2014). The scores come from the scorer as taught
beforehand, without the adaptation to an archive, because every training fold learns its own.
"""

from dataclasses import dataclass

import numpy as np

from capsule.arrays import FloatArray
from capsule.detectors.scorer import SENSORS, Scorer, standardised

# In beats; a wave has four. A stretch is two waves long and starts half a wave after the last one.
WIDTH = 8
STEP = 2
# The first rows from `standardised`: the series, which are 0 in a usual beat. The rows after them
# hold the spreads over the whole recording and stay unchanged.
_SERIES = 13


@dataclass(frozen=True)
class Stretches:
    """The loss of score without each stretch of a recording.

    Attributes
    ----------
    score : float
        Score of the whole recording, by the scorer as taught beforehand.
    first, step : float
        Centre of the first stretch, and the distance from centre to centre, in beats.
    loss : (M,) array
        The score minus the score without the stretch; above 0 if the stretch indicates a nodule.
    """

    score: float
    first: float
    step: float
    loss: FloatArray


def score_stretches(scorer: Scorer, series: FloatArray | None) -> Stretches | None:
    """Return the loss of score without each stretch of a recording.

    Parameters
    ----------
    scorer : Scorer
        The taught scorer.
    series : (4, 5, N) array, or None
        From `capsule.detectors.beat_series.beat_series`.

    Returns
    -------
    Stretches or None
        None if the scorer gives no score.
    """
    if series is None or series.shape[0] != SENSORS:
        return None
    x = standardised(series)
    whole = scorer.score(x)
    starts = range(0, max(x.shape[-1] - WIDTH, 0) + 1, STEP)
    loss = np.empty(len(starts))
    for number, start in enumerate(starts):
        without = x.copy()
        without[:, :_SERIES, start : start + WIDTH] = 0.0
        loss[number] = whole - scorer.score(without)
    return Stretches(whole, (WIDTH - 1) / 2, float(STEP), loss)
