"""What becomes of a suspected place after it was passed again.

Assumptions. Evidence counts in parts of what is usually the largest in some centimetres of healthy
gut at present, so the limits hold on a noisier bench as well. The first pass counts with the
others, although it was chosen because it was high: the limits are learned from suspected healthy
places, which were chosen in the same way. What differs from pass to pass (seat, noise, drift) is
drawn anew in each; the nodule's height against the capsule and the wall's unevenness are not, so
passes over one place are far from independent, and no sequential test that assumes so is used.
"""

from collections.abc import Sequence

import numpy as np


def decide(
    heights: Sequence[float], *, confirm: float, dismiss: float, at_last: float, most: int
) -> str:
    """Return what all passes over a place say.

    Parameters
    ----------
    heights : sequence of float
        Evidence of the first pass and of each pass again within reach of the place, in parts of
        the usual; NaN for a pass that is no evidence.
    confirm : float
        A mean height above it confirms.
    dismiss : float
        A mean height below it dismisses.
    at_last : float
        After the last pass, a mean height above it confirms.
    most : int
        How many passes again there may be.

    Returns
    -------
    {"confirmed", "dismissed", "again", "undecided"}
    """
    again = np.array(heights[1:])
    last = len(again) >= most
    if np.isnan(again).all():
        return "undecided" if last else "again"
    mean = np.nanmean(heights)
    if mean > (at_last if last else confirm):
        return "confirmed"
    if mean < dismiss:
        return "dismissed"
    return "undecided" if last else "again"
