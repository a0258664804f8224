"""Several passes over one place, judged together: the paper's return to a suspicious place."""

from collections.abc import Mapping, Sequence

import numpy as np

from capsule.detectors.operating_point import threshold_at


def first_passes(sites: Sequence[str], count: int) -> dict[str, list[int]]:
    """Take the first passes over every place that has enough of them.

    Parameters
    ----------
    sites : sequence of R str
        The place of each recording.
    count : int
        Wanted number of passes.

    Returns
    -------
    dict of str to list of int
        Places among the recordings, by site.
    """
    passes: dict[str, list[int]] = {}
    for place, site in enumerate(sites):
        passes.setdefault(site, []).append(place)
    return {site: places[:count] for site, places in passes.items() if len(places) >= count}


def combined_detections(
    scores: np.ndarray,
    sizes_mm: np.ndarray,
    passes: Mapping[str, Sequence[int]],
    specificity: float | None,
) -> tuple[np.ndarray, np.ndarray]:
    """Judge every place by the mean score of its passes.

    Parameters
    ----------
    scores : (R,) array
        Scores of single recordings; an unknown one (NaN) does not count, and a place of which
        none is known is left aside.
    sizes_mm : (R,) array
        True sizes, 0 for no nodule.
    passes : mapping of str to sequence of int
        The recordings of each place.
    specificity : float or None
        Wanted of the threshold, chosen on the mean scores of the other healthy places; None for a
        detector whose threshold is fixed at 0.

    Returns
    -------
    true_mm : (P,) array
        Size at each place.
    detected : (P,) array of bool
        Whether a nodule is detected there.
    """
    known = [[one for one in places if not np.isnan(scores[one])] for places in passes.values()]
    known = [places for places in known if places]
    means = np.array([scores[places].mean() for places in known])
    true_mm = np.array([sizes_mm[places[0]] for places in known])
    healthy = true_mm == 0
    detected = np.zeros(means.size, dtype=bool)
    for place, mean in enumerate(means):
        others = healthy.copy()
        others[place] = False
        threshold = 0.0 if specificity is None else threshold_at(means[others], specificity)
        detected[place] = mean > threshold
    return true_mm, detected
