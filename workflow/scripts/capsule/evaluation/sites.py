"""Several passes over one site, judged together by their mean score.

The paper's capsule goes back to a suspicious place. The mean over several passes scatters less than
a single score.
"""

from collections.abc import Callable, Iterable, Mapping
from functools import cache
from typing import TypeAlias

import numpy as np

from capsule.arrays import BoolArray, FloatArray
from capsule.detectors.calibrate import rank_threshold
from capsule.detectors.registry import detector_row
from capsule.kinds import Cells, Row

_OF_A_NODULE = ("estimate_mm", "location_mm", "estimate_low_mm", "estimate_high_mm")
COLUMNS = (
    *("site", "size_mm", "recordings", "detector"),
    *("passes", "score", "threshold", "detected", *_OF_A_NODULE),
    *("familiar", "unfamiliar_because"),
)
#: A detector's results for the passes over each site, by column; NaN if a pass has none. The key is
#: the site with its true size, 0 for no nodule; None if it is unknown.
PassesBySite: TypeAlias = Mapping[tuple[str, float | None], Mapping[str, FloatArray]]


def site_rows(
    predictions: Iterable[Row], sites: Mapping[str, str], specificity: float
) -> list[Cells]:
    """Return each detector's verdict on every site with several recordings, by `site_verdicts`.

    Parameters
    ----------
    predictions : iterable of mapping
        One row for each detector and recording, as in results/evaluation/predictions.csv and
        results/detections.csv.
    sites : mapping of str to str
        The site in each recording's header; empty if it names none.
    specificity : float
        Wanted specificity of detectors that learn a threshold.
    """
    predictions = list(predictions)
    unfamiliar = _unfamiliar_passes(predictions, sites)
    of_detector: dict[str, list[Row]] = {}
    for row in predictions:
        of_detector.setdefault(row["detector"], []).append(row)
    made = []
    for detector, rows in of_detector.items():
        passes = passes_by_site(rows, sites)
        for verdict in site_verdicts(passes, detector, specificity, fewest=2):
            because = unfamiliar.get(verdict["site"])
            known = "" if because is None else "no" if because else "yes"
            made.append(verdict | {"familiar": known, "unfamiliar_because": because or ""})
    return made


def _unfamiliar_passes(predictions: Iterable[Row], sites: Mapping[str, str]) -> dict[str, str]:
    """Return of each site with a pass that is familiar or not which pass is not, and why."""
    unfamiliar: dict[str, str] = {}
    for row in predictions:
        site, answer = sites[row["recording"]], row.get("familiar")
        if answer in ("yes", "no") and not unfamiliar.get(site):
            because = f"{row['recording']}: {row['unfamiliar_because']}" if answer == "no" else ""
            unfamiliar[site] = because
    return unfamiliar


def passes_by_site(rows: Iterable[Row], sites: Mapping[str, str]) -> PassesBySite:
    """Return the passes of one detector by site; passes have the order of the sites.

    The same site with another label is another site. A recording without a site is a site of its
    own. For the parameters see `site_rows`.
    """
    turn = {recording: number for number, recording in enumerate(sites)}
    by_site: dict[tuple[str, float | None], list[Row]] = {}
    for row in rows:
        size_mm = number(row.get("size_mm", ""))
        site = sites[row["recording"]] or row["recording"]
        by_site.setdefault((site, None if np.isnan(size_mm) else size_mm), []).append(row)
    for of_site in by_site.values():
        of_site.sort(key=lambda row: turn[row["recording"]])
    return {
        site: {
            name: np.array([number(row[name]) for row in of_site])
            for name in ("score", *_OF_A_NODULE)
        }
        for site, of_site in by_site.items()
    }


def site_verdicts(
    passes: PassesBySite, detector: str, specificity: float, fewest: int = 1
) -> list[Cells]:
    """Return a detector's verdicts on sites from all their passes.

    The threshold is also learned from means. Each mean is over as many passes of another healthy
    site as this site has. A healthy site with fewer passes gives the mean of all its passes, which
    makes the threshold rather too high.

    Parameters
    ----------
    passes : mapping
        The passes by site.
    detector : str
        Its name, which tells whether it learns a threshold.
    specificity : float
        Wanted specificity of the threshold.
    fewest : int
        Sites with fewer passes are not judged. They teach.

    Returns
    -------
    list of dict
        One row for each site, with the columns `COLUMNS` but whether it is familiar:

        - ``passes``: how many of them have a score; ``score`` is their mean.
        - ``detected``: whether the score is above the threshold; None for no verdict.
        - ``estimate_mm``, ``location_mm``: mean size, and median location, of the passes in which a
          nodule is detected. NaN if none is detected at the site, or in no single pass.
        - ``estimate_low_mm``, ``estimate_high_mm``: mean ends of the intervals of these passes.
          The interval does not shrink with more passes, because the mean does not reduce an error
          that the nodule's set-up causes in all of them. It is rather too wide.
    """
    healthy = {
        site: _known(of_site["score"])
        for (site, size_mm), of_site in passes.items()
        if size_mm == 0
    }

    @cache
    def means(count: int) -> FloatArray:
        return np.array([_of(np.mean, scores[:count]) for scores in healthy.values()])

    # Sites that teach nothing have the same threshold. Most sites are of this kind.
    @cache
    def threshold_without(site: str | None, count: int) -> float:
        known = _known(means(count)[[name != site for name in healthy]])
        return rank_threshold(known, np.arange(known.size), specificity)

    fixed, verdicts = detector_row(detector).fixed_threshold, []
    for (site, size_mm), of_site in passes.items():
        recordings, scores = of_site["score"].size, _known(of_site["score"])
        if recordings < fewest:
            continue
        score, threshold = _of(np.mean, scores), fixed
        if threshold is None:
            # The healthy passes over a site that also has other passes do not teach these, either.
            threshold = threshold_without(site if site in healthy else None, scores.size)
        detected = None if np.isnan(score) or np.isnan(threshold) else score > threshold
        verdict = {"site": site, "size_mm": size_mm, "recordings": recordings, "detector": detector}
        verdict |= {"passes": scores.size, "score": score}
        verdict |= {"threshold": threshold, "detected": detected}
        for name in _OF_A_NODULE:
            summary = np.median if name == "location_mm" else np.mean
            verdict[name] = _of(summary, _known(of_site[name])) if detected else float("nan")
        verdicts.append(verdict)
    return verdicts


def detections_by_passes(
    passes: PassesBySite, detector: str, count: int, specificity: float
) -> tuple[FloatArray, BoolArray]:
    """Return at which sites a nodule is detected if each is judged by its first `count` passes.

    The true sizes, which are known, come with what is detected, never without a verdict. Sites with
    fewer passes are left out, and all sites if no threshold can be learned from as many passes. The
    other parameters are those of `site_verdicts`.
    """
    first = {
        site: {name: values[:count] for name, values in of_site.items()}
        for site, of_site in passes.items()
        if of_site["score"].size >= count
    }
    verdicts = site_verdicts(first, detector, specificity)
    if all(verdict["detected"] is None for verdict in verdicts):
        verdicts = []
    true_mm = np.array([verdict["size_mm"] for verdict in verdicts], dtype=np.float64)
    return true_mm, np.array([bool(verdict["detected"]) for verdict in verdicts], dtype=bool)


def number(text: str | float) -> float:
    """Return the number in a cell or header line; NaN if it is not a number."""
    try:
        return float(text)
    except ValueError:
        return float("nan")


def _known(values: FloatArray) -> FloatArray:
    return values[~np.isnan(values)]


def _of(summary: Callable[[FloatArray], np.floating], values: FloatArray) -> float:
    """Return a summary of values; NaN if there is none."""
    return float(summary(values)) if values.size else float("nan")
