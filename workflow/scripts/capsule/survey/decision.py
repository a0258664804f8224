"""The decision on a suspected place after the capsule has passed it again.

Assumptions:

- The unit of evidence is the largest evidence that some centimetres of healthy gut usually have at
  present. So the limits also hold on a noisier bench.
- The first pass counts as well, although it was selected for its high evidence. The limits were
  learned from suspected healthy places, which were selected in the same way.
- Seat, noise and drift differ from pass to pass. The nodule's height against the capsule and the
  wall's unevenness do not. Passes over one place are therefore far from independent, and the
  decision uses no sequential test that assumes independence.
"""

from collections.abc import Sequence

import numpy as np


def decide(
    heights: Sequence[float], *, confirm: float, dismiss: float, at_last: float, most: int
) -> str:
    """Return the decision from all passes over a place.

    Parameters
    ----------
    heights : sequence of float
        Evidence near the place in the first pass and in each repeated pass, in units of the usual
        evidence; NaN for a pass without evidence.
    confirm : float
        A mean height above it confirms.
    dismiss : float
        A mean height below it dismisses.
    at_last : float
        After the last pass, a mean height above it confirms.
    most : int
        Largest number of repeated passes.

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
