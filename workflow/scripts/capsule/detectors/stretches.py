"""Which stretches of a recording raise the taught scorer's score: what it loses without each.

Each stretch in turn is made usual, on all sensors at once, and the recording is scored again
(occlusion, Zeiler and Fergus 2014). The scores are those taught beforehand. The adaptation to an
archive is left out: every training fold learns its own.
"""

from dataclasses import dataclass

import numpy as np

from capsule.arrays import FloatArray
from capsule.detectors.scorer import SENSORS, Scorer, standardised

# In beats, of which four are a wave: two waves, each half a wave after the one before.
WIDTH = 8
STEP = 2
# Of what `standardised` lays out: the series, which are 0 in a usual beat. The spreads behind them
# are of the whole recording and stay.
_SERIES = 13


@dataclass(frozen=True)
class Stretches:
    """What the score loses without each stretch.

    Attributes
    ----------
    score : float
        Taught beforehand, of the whole recording.
    first, step : float
        Centre of the first stretch, and the distance from centre to centre, in beats.
    loss : (M,) array
        The score less the score without the stretch: above 0, the stretch speaks for a nodule.
    """

    score: float
    first: float
    step: float
    loss: FloatArray


def score_stretches(scorer: Scorer, series: FloatArray | None) -> Stretches | None:
    """Score a recording without each of its stretches.

    Parameters
    ----------
    scorer : Scorer
        The taught scorer.
    series : (4, 5, N) array, or None
        From `capsule.detectors.beat_series.beat_series`.

    Returns
    -------
    Stretches or None
        None where the scorer gives no score.
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
