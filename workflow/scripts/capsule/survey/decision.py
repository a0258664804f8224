"""What becomes of a suspected place after it was passed again.

Assumptions. Evidence counts as how far it is above the usual evidence at present, in its spreads,
so the limits hold on a noisier bench as well. Only passes again count: the pass that raised the
suspicion was chosen because it was high. What differs from pass to pass (seat, noise, drift) is
drawn anew in each; the nodule's height against the capsule and the wall's unevenness are not, so
passes over a nodule are far from independent, and no sequential test that assumes so is used.
"""

from collections.abc import Sequence

import numpy as np


def decide(heights: Sequence[float], *, confirm: float, dismiss: float, most: int) -> str:
    """Return what the passes again say.

    Parameters
    ----------
    heights : sequence of float
        Evidence of each pass again within reach of the place, above the usual in its spreads; NaN
        for a pass that is no evidence.
    confirm : float
        Above it one pass, or the mean of all, confirms.
    dismiss : float
        Below it the newest pass dismisses.
    most : int
        How many passes again there may be.

    Returns
    -------
    {"confirmed", "dismissed", "again", "undecided"}
    """
    if heights and heights[-1] > confirm:
        return "confirmed"
    if heights and heights[-1] < dismiss:
        return "dismissed"
    if len(heights) < most:
        return "again"
    known = [height for height in heights if not np.isnan(height)]
    return "confirmed" if known and np.mean(known) > confirm else "undecided"
