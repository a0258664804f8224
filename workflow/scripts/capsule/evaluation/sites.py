"""Several passes over one site, judged together by their mean score.

The paper's capsule goes back to a suspicious place. The mean over several passes scatters less than
a single score.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cache

import numpy as np

from capsule.arrays import BoolArray, FloatArray
from capsule.detectors.calibrate import rank_threshold
from capsule.detectors.registry import detector_row
from capsule.kinds import Cells, Row


@dataclass(frozen=True)
class Passes:
    """One detector's results for the passes over one site.

    Attributes
    ----------
    size_mm : float
        True size, 0 for no nodule; NaN if it is unknown.
    score, estimate_mm, location_mm, estimate_low_mm, estimate_high_mm : (P,) array
        Result of each pass; NaN if it has none.
    """

    size_mm: float
    score: FloatArray
    estimate_mm: FloatArray
    location_mm: FloatArray
    estimate_low_mm: FloatArray
    estimate_high_mm: FloatArray

    def first(self, count: int) -> "Passes":
        """Return the first `count` passes only."""
        return Passes(self.size_mm, *(getattr(self, name)[:count] for name in _OF_A_PASS))


# The arrays of `Passes`, with their names in results/evaluation/predictions.csv.
_OF_A_PASS = tuple(name for name in Passes.__annotations__ if name != "size_mm")


@dataclass(frozen=True)
class SiteVerdict:
    """A detector's verdict on a site.

    Attributes
    ----------
    passes : int
        Number of passes that have a score.
    score, threshold : float
        Mean score of these passes; a score above the threshold means a nodule.
    detected : bool or None
        None for no verdict.
    estimate_mm, location_mm : float
        Mean size, and median location, of the passes in which a nodule is detected. NaN if no
        nodule is detected at the site, or no single pass is above its own threshold.
    estimate_low_mm, estimate_high_mm : float
        Means of the lower and of the upper ends of the intervals of these passes; NaN if the
        estimate is NaN or has no interval. The interval does not shrink with more passes, because
        the mean does not reduce an error that the nodule's set-up causes in all passes. The mean
        does reduce errors that differ from pass to pass, so the interval is rather too wide.
    """

    passes: int
    score: float
    threshold: float
    detected: bool | None
    estimate_mm: float
    location_mm: float
    estimate_low_mm: float
    estimate_high_mm: float


_FAMILIAR = ("familiar", "unfamiliar_because")
COLUMNS = (
    "site",
    "size_mm",
    "recordings",
    "detector",
    *SiteVerdict.__annotations__,
    *_FAMILIAR,
)


def site_rows(
    predictions: Iterable[Row], sites: Mapping[str, str], specificity: float
) -> list[Cells]:
    """Return a verdict on every site with several recordings, from all of them together.

    Parameters
    ----------
    predictions : iterable of mapping
        One row for each detector and recording, as in results/evaluation/predictions.csv and
        results/detections.csv.
    sites : mapping of str to str
        The site in each recording's header; empty if it names none.
    specificity : float
        Wanted specificity of detectors that learn a threshold.

    Returns
    -------
    list of dict
        One row for each detector and site, with the columns `COLUMNS`.
    """
    predictions = list(predictions)
    unfamiliar = _unfamiliar_passes(predictions, sites)
    rows = []
    for detector, by_site in passes_by_site(predictions, sites).items():
        fixed = detector_row(detector).fixed_threshold
        several = {site: passes for site, passes in by_site.items() if passes.score.size > 1}
        for site, verdict in site_verdicts(several, by_site, specificity, fixed).items():
            passes = by_site[site]
            row = {"site": site.partition("\n")[0], "size_mm": passes.size_mm}
            row |= {"recordings": passes.score.size, "detector": detector}
            because = unfamiliar.get(str(row["site"]))
            known = "" if because is None else "no" if because else "yes"
            kind = {"familiar": known, "unfamiliar_because": because or ""}
            rows.append(row | vars(verdict) | kind)
    return rows


def _unfamiliar_passes(predictions: Iterable[Row], sites: Mapping[str, str]) -> dict[str, str]:
    """Return of each site with a pass that is familiar or not which pass is not, and why."""
    unfamiliar: dict[str, str] = {}
    for row in predictions:
        site, answer = sites[row["recording"]], row.get("familiar")
        if answer in ("yes", "no") and not unfamiliar.get(site):
            because = f"{row['recording']}: {row['unfamiliar_because']}" if answer == "no" else ""
            unfamiliar[site] = because
    return unfamiliar


def passes_by_site(
    predictions: Iterable[Row], sites: Mapping[str, str]
) -> dict[str, dict[str, Passes]]:
    """Return the passes by detector and site; a recording without a site is a site of its own.

    The same site with another label is another site. The first line of a key is the site's name.
    Passes over a site have the order of `sites`.
    """
    turn = {recording: place for place, recording in enumerate(sites)}
    sorted_rows: dict[str, dict[str, list[Row]]] = {}
    for row in predictions:
        site = f"{sites[row['recording']] or row['recording']}\n{row.get('size_mm', '')}"
        sorted_rows.setdefault(row["detector"], {}).setdefault(site, []).append(row)
    for group in [group for by_site in sorted_rows.values() for group in by_site.values()]:
        group.sort(key=lambda row: turn[row["recording"]])
    return {
        detector: {
            site: Passes(
                number(group[0].get("size_mm", "")),
                *(np.array([number(row[column]) for row in group]) for column in _OF_A_PASS),
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
    """Return verdicts on sites from all their passes.

    The threshold is also learned from means. Each mean is over as many passes of another healthy
    site as this site has. A healthy site with fewer passes gives the mean of all its passes, which
    makes the threshold rather too high.

    Parameters
    ----------
    judged : mapping of str to Passes
        The sites to judge.
    teaching : mapping of str to Passes
        Sites, of which the healthy ones teach. No site teaches its own threshold. Two sites are
        one if the first lines of their names are the same.
    specificity : float
        Wanted specificity of the threshold.
    fixed_threshold : float, optional
        Threshold of a detector that learns none.

    Returns
    -------
    dict of str to SiteVerdict
    """
    healthy = {name: passes.score for name, passes in teaching.items() if passes.size_mm == 0}
    # The healthy passes over a site that also has other passes do not teach these, either.
    place = {name.partition("\n")[0]: index for index, name in enumerate(healthy)}

    @cache
    def means(count: int) -> FloatArray:
        return np.array([_mean_of(score, count) for score in healthy.values()], dtype=np.float64)

    # Sites that teach nothing have the same threshold. Most sites are of this kind.
    @cache
    def threshold_without(index: int | None, count: int) -> float:
        others = means(count) if index is None else np.delete(means(count), index)
        known = others[~np.isnan(others)]
        return rank_threshold(known, np.arange(known.size), specificity)

    verdicts = {}
    for name, passes in judged.items():
        count = int(np.count_nonzero(~np.isnan(passes.score)))
        threshold = fixed_threshold
        if threshold is None:
            threshold = threshold_without(place.get(name.partition("\n")[0]), count)
        verdicts[name] = _verdict(passes, count, threshold)
    return verdicts


def detections_by_passes(
    sites: Mapping[str, Passes],
    count: int,
    specificity: float,
    fixed_threshold: float | None = None,
) -> tuple[FloatArray, BoolArray]:
    """Return at which sites a nodule is detected if each is judged by its first passes.

    Parameters
    ----------
    sites : mapping of str to Passes
        Sites of known size. Sites with fewer passes are left out, and all sites if no threshold can
        be learned from as many passes.
    count : int
        Number of passes that are judged together.
    specificity, fixed_threshold
        As in `site_verdicts`.

    Returns
    -------
    true_mm : (P,) array
        True size at each judged site.
    detected : (P,) array of bool
        True if a nodule is detected there; never without a verdict.
    """
    first = {name: each.first(count) for name, each in sites.items() if each.score.size >= count}
    verdicts = site_verdicts(first, first, specificity, fixed_threshold)
    if all(verdict.detected is None for verdict in verdicts.values()):
        verdicts = {}
    true_mm = np.array([first[name].size_mm for name in verdicts], dtype=np.float64)
    return true_mm, np.array([bool(each.detected) for each in verdicts.values()], dtype=bool)


def number(text: str | float) -> float:
    """Return the number in a cell or header line; NaN if it is not a number."""
    try:
        return float(text)
    except ValueError:
        return float("nan")


def _mean_of(scores: FloatArray, count: int | None = None) -> float:
    """Return the mean of the first `count` known scores; NaN if there is none."""
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
