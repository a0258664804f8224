"""Find what each stretch of a recording adds to the taught score."""

import numpy as np

from capsule.arrays import FloatArray
from capsule.detectors.network import SENSORS, SERIES_ROWS, Scorer, standardised

# In beats; a wave has four. A stretch is two waves long and starts half a wave after the last one.
WIDTH, STEP = 8, 2
# Centre of the first stretch, in beats from the first beat.
FIRST = (WIDTH - 1) / 2


def score_stretches(scorer: Scorer, series: FloatArray | None) -> tuple[float, FloatArray] | None:
    """Return what the taught score loses without each stretch of a recording.

    One stretch after another is replaced by usual beats, on all sensors at once, and the recording
    is scored again (occlusion, Zeiler and Fergus 2014). These scores come from the scorer as taught
    beforehand, because every training fold adapts its own.

    Parameters
    ----------
    scorer : Scorer
        The taught scorer.
    series : (4, 5, N) array, or None
        As in `Scorer.features`.

    Returns
    -------
    score : float
        Score of the whole recording; None instead of both if the scorer gives no score.
    loss : (M,) array
        The score minus the score without the stretch; above 0 if the stretch indicates a nodule.
    """
    if series is None or series.shape[0] != SENSORS:
        return None
    x = standardised(series)
    whole = scorer.forward(x)[0]
    starts = range(0, max(x.shape[-1] - WIDTH, 0) + 1, STEP)
    loss = np.empty(len(starts))
    for number, start in enumerate(starts):
        without = x.copy()
        without[:, :SERIES_ROWS, start : start + WIDTH] = 0.0
        loss[number] = whole - scorer.forward(without)[0]
    return whole, loss
