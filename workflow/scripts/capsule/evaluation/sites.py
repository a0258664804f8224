"""Several passes over one place, judged together by their mean score.

The paper's capsule goes back to a suspicious place; the mean over passes scatters less than one
score.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from capsule.arrays import BoolArray, FloatArray
from capsule.detectors.operating_point import threshold_at
from capsule.detectors.registry import detector_row
from capsule.kinds import Cells


@dataclass(frozen=True)
class Passes:
    """What one detector says of the passes over one place.

    Attributes
    ----------
    size_mm : float
        True size, 0 for no nodule; NaN where it is not known.
    score, estimate_mm, location_mm, estimate_low_mm, estimate_high_mm : (P,) array
        Of each pass; NaN where it says nothing.
    """

    size_mm: float
    score: FloatArray
    estimate_mm: FloatArray
    location_mm: FloatArray
    estimate_low_mm: FloatArray
    estimate_high_mm: FloatArray

    def first(self, count: int) -> "Passes":
        """Take the first passes, as if no more had been made."""
        return Passes(self.size_mm, *(getattr(self, name)[:count] for name in _OF_A_PASS))


# The arrays of `Passes`, as results/evaluation/predictions.csv calls them.
_OF_A_PASS = tuple(name for name in Passes.__annotations__ if name != "size_mm")


@dataclass(frozen=True)
class SiteVerdict:
    """A detector's verdict on a place.

    Attributes
    ----------
    passes : int
        How many of them have a score.
    score, threshold : float
        Mean score of these passes; a score above the threshold means a nodule.
    detected : bool or None
        None where nothing can be said.
    estimate_mm, location_mm : float
        Mean size, and median place, of the passes in which a nodule is detected; NaN where the
        verdict is none, or no single pass is above its own threshold.
    estimate_low_mm, estimate_high_mm : float
        Mean of the lower, and of the upper ends of the intervals of these passes; NaN where the
        estimate is, or has none. The interval does not shrink with the number of passes: what the
        set-up of the nodule does to one pass it does to all, and a mean over passes does not take
        that away. What differs from pass to pass it does, so the interval is rather too wide.
    """

    passes: int
    score: float
    threshold: float
    detected: bool | None
    estimate_mm: float
    location_mm: float
    estimate_low_mm: float
    estimate_high_mm: float


COLUMNS = ("site", "size_mm", "recordings", "detector", *SiteVerdict.__annotations__)


def site_rows(
    predictions: Iterable[Mapping[str, str]], sites: Mapping[str, str], specificity: float
) -> list[Cells]:
    """Judge every place that was passed more than once by all its recordings together.

    Parameters
    ----------
    predictions : iterable of mapping of str to str
        A row a detector and recording, as in results/evaluation/predictions.csv and
        results/detections.csv.
    sites : mapping of str to str
        The place that each recording names, empty where it names none.
    specificity : float
        Wanted of the detectors that learn a threshold.

    Returns
    -------
    list of dict
        A row a detector and place, of `COLUMNS`.
    """
    rows = []
    for detector, by_site in passes_by_site(predictions, sites).items():
        fixed = detector_row(detector).fixed_threshold
        several = {site: passes for site, passes in by_site.items() if passes.score.size > 1}
        for site, verdict in site_verdicts(several, by_site, specificity, fixed).items():
            passes = by_site[site]
            row = {"site": site.partition("\n")[0], "size_mm": passes.size_mm}
            row |= {"recordings": passes.score.size, "detector": detector}
            rows.append(row | vars(verdict))
    return rows


def passes_by_site(
    predictions: Iterable[Mapping[str, str]], sites: Mapping[str, str]
) -> dict[str, dict[str, Passes]]:
    """Sort verdicts by detector and place; a recording that names none is a place by itself.

    The same place with another label is another place; the first line of a key is the name. Passes
    over a place are in the order of `sites`.
    """
    turn = {recording: place for place, recording in enumerate(sites)}
    sorted_rows: dict[str, dict[str, list[Mapping[str, str]]]] = {}
    for row in predictions:
        site = f"{sites[row['recording']] or row['recording']}\n{row.get('size_mm', '')}"
        sorted_rows.setdefault(row["detector"], {}).setdefault(site, []).append(row)
    for group in [group for by_site in sorted_rows.values() for group in by_site.values()]:
        group.sort(key=lambda row: turn[row["recording"]])
    return {
        detector: {
            site: Passes(
                float(group[0].get("size_mm") or "nan"),
                *(
                    np.array([float(row[column] or "nan") for row in group])
                    for column in _OF_A_PASS
                ),
            )
            for site, group in by_site.items()
        }
        for detector, by_site in sorted_rows.items()
    }


def site_verdicts(
    judged: Mapping[str, Passes],
    teaching: Mapping[str, Passes],
    specificity: float,
    fixed_threshold: float | None = None,
) -> dict[str, SiteVerdict]:
    """Judge places by all their passes.

    The threshold is learned from means too: of as many passes over every other healthy place as
    over this one. A place with fewer gives the mean of those it has, which errs to the side of too
    high a threshold.

    Parameters
    ----------
    judged : mapping of str to Passes
        The places that are judged.
    teaching : mapping of str to Passes
        The places whose healthy ones teach; a judged place teaches all but itself.
    specificity : float
        Wanted of the threshold.
    fixed_threshold : float, optional
        Of a detector that learns none.

    Returns
    -------
    dict of str to SiteVerdict
    """
    healthy = [name for name, passes in teaching.items() if passes.size_mm == 0]
    means: dict[int, dict[str, float]] = {}
    verdicts = {}
    for name, passes in judged.items():
        count = int(np.count_nonzero(~np.isnan(passes.score)))
        if count not in means:
            means[count] = {other: _mean_of(teaching[other].score, count) for other in healthy}
        threshold = fixed_threshold
        if threshold is None:
            others = [mean for other, mean in means[count].items() if other != name]
            threshold = _threshold(others, specificity)
        verdicts[name] = _verdict(passes, count, threshold)
    return verdicts


def detections_by_passes(
    sites: Mapping[str, Passes],
    count: int,
    specificity: float,
    fixed_threshold: float | None = None,
) -> tuple[FloatArray, BoolArray]:
    """Tell where a nodule is detected when each place is judged by its first passes.

    Parameters
    ----------
    sites : mapping of str to Passes
        Places of known size; those with fewer passes are left aside, and so is one of which nothing
        can be said.
    count : int
        Number of passes that are judged together.
    specificity, fixed_threshold
        As in `site_verdicts`.

    Returns
    -------
    true_mm : (P,) array
        Size at each place that is judged.
    detected : (P,) array of bool
        Whether a nodule is detected there.
    """
    first = {name: each.first(count) for name, each in sites.items() if each.score.size >= count}
    verdicts = site_verdicts(first, first, specificity, fixed_threshold)
    known = [name for name, verdict in verdicts.items() if verdict.detected is not None]
    true_mm = np.array([first[name].size_mm for name in known])
    return true_mm, np.array([verdicts[name].detected for name in known], dtype=bool)


def _threshold(means: Sequence[float], specificity: float) -> float:
    known = np.array(means, dtype=np.float64)
    return threshold_at(known[~np.isnan(known)], specificity)


def _mean_of(scores: FloatArray, count: int | None = None) -> float:
    """Average the first so many known scores; NaN without any."""
    known = scores[~np.isnan(scores)][:count]
    return float(known.mean()) if known.size else float("nan")


def _verdict(passes: Passes, count: int, threshold: float) -> SiteVerdict:
    score = _mean_of(passes.score)
    detected = None if np.isnan(score) or np.isnan(threshold) else score > threshold
    estimate = place = low = high = float("nan")
    if detected:
        estimate, low, high = (
            _mean_of(each)
            for each in (passes.estimate_mm, passes.estimate_low_mm, passes.estimate_high_mm)
        )
        known = passes.location_mm[~np.isnan(passes.location_mm)]
        place = float(np.median(known)) if known.size else place
    return SiteVerdict(count, score, threshold, detected, estimate, place, low, high)
