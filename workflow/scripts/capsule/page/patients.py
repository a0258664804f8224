"""The verdict on every patient: on each unlabelled recording, or site with several passes."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import pandas as pd

from capsule import words
from capsule.kinds import Cells, Row
from capsule.naming import UNLABELLED, folder_of
from capsule.page.evidence import Stored
from capsule.page.quality import quality_words

# So many rows stand open; the others are folded.
SHOWN = 20
# Nodules come first; what nobody could judge stands before what was found healthy.
_ORDER = ("nodule", "no verdict", "no nodule")


@dataclass(frozen=True)
class Found:
    """What a detector says of a patient.

    Attributes
    ----------
    kind : {"nodule", "no nodule", "no verdict"}
    size, place, probability : str
        In words.
    reason : str
        Why there is no verdict, where the detector tells.
    chance : float
        The probability as a number, 0 where there is none; to sort by.
    """

    kind: str
    size: str = words.NOT_APPLICABLE
    place: str = words.NOT_APPLICABLE
    probability: str = words.NOT_GIVEN
    reason: str = ""
    chance: float = 0.0

    def text(self) -> str:
        """Return the verdict, with the reason for none."""
        return f"{self.kind}: {self.reason}" if self.reason else self.kind


def page_values(
    index: pd.DataFrame,
    detections: pd.DataFrame,
    sites: pd.DataFrame,
    lead: str,
    load: Callable[[str], Stored],
    rate_hz: float,
) -> Cells:
    """Return the verdicts of the first screen.

    Parameters
    ----------
    index, detections, sites : DataFrame
        results/recordings.csv, detections.csv and sites.csv.
    lead : str
        The detector whose verdict is shown; of the others only whether they agree.
    load : callable
        ``load(name)`` returns what is stored of an accepted recording.
    rate_hz : float
        Sampling rate.

    Returns
    -------
    dict
        ``rows`` and ``folded`` (of ``patient``, ``site``, ``recordings``, ``kind``, ``verdict``,
        ``size``, ``place``, ``probability``, ``quality`` and ``others``), nodules first, and
        ``counts``, a sentence or two; no row without an unlabelled recording.
    """

    def quality(name: str) -> str:
        stored = load(name)
        return quality_words(stored.values, stored.at_ends, rate_hz)

    rows = [*_site_rows(index, sites, lead, quality)]
    of_sites = {each["name"] for row in rows for each in row["recordings"]}
    rows += _recording_rows(index, detections, lead, quality, of_sites)
    rows.sort(key=lambda row: (_ORDER.index(row["kind"]), -row["chance"]))
    counts = _counts(rows, lead, sites=bool(of_sites))
    return {"rows": rows[:SHOWN], "folded": rows[SHOWN:], "counts": counts}


def _recording_rows(
    index: pd.DataFrame,
    detections: pd.DataFrame,
    lead: str,
    quality: Callable[[str], str],
    of_sites: set[str],
) -> Iterator[Cells]:
    """Yield a row an unlabelled recording that belongs to no site with a verdict of its own."""
    verdicts: dict[str, dict[str, Found]] = {}
    for row in detections.to_dict("records"):
        verdicts.setdefault(row["recording"], {})[row["detector"]] = of_recording(row)
    for row in index.to_dict("records"):
        name = row["recording"]
        if row["status"] == "accepted" and not words.is_known(row["size_mm"]):
            if name not in of_sites:
                yield _row(_label(name), [name], verdicts.get(name, {}), lead, quality(name))
        elif row["status"] != "accepted" and folder_of(name) == UNLABELLED:
            yield _row(_label(name), [], {}, lead, f"rejected: {row['reason']}")


def _site_rows(
    index: pd.DataFrame, sites: pd.DataFrame, lead: str, quality: Callable[[str], str]
) -> Iterator[Cells]:
    """Yield a row an unlabelled site that was passed several times."""
    unlabelled = index[(index["status"] == "accepted") & index["size_mm"].isna()]
    for site, rows in sites[sites["size_mm"].isna()].groupby("site", sort=False):
        names = list(unlabelled.loc[unlabelled["site"] == site, "recording"])
        verdicts = {row["detector"]: of_site(row) for row in rows.to_dict("records")}
        each = {name: quality(name) for name in names}
        said = [f"{_label(name)}: {text}" for name, text in each.items()]
        together = "; ".join(said) if len(set(each.values())) > 1 else next(iter(each.values()), "")
        yield _row(str(site), names, verdicts, lead, together, site=True)


def _row(
    patient: str,
    names: Sequence[str],
    verdicts: Mapping[str, Found],
    lead: str,
    quality: str,
    *,
    site: bool = False,
) -> Cells:
    verdict = verdicts.get(lead, Found("no verdict"))
    return {
        "patient": patient,
        "site": site,
        "recordings": [{"name": name, "label": _label(name)} for name in names],
        "kind": verdict.kind,
        "verdict": verdict.text(),
        "size": verdict.size,
        "place": verdict.place,
        "probability": verdict.probability,
        "chance": verdict.chance,
        "quality": quality,
        "others": others_words(verdict, {n: v for n, v in verdicts.items() if n != lead}),
    }


def _label(name: str) -> str:
    """Name an unlabelled recording without the folder that all of them lie in."""
    return name.removeprefix(f"{UNLABELLED}/")


def of_recording(row: Row) -> Found:
    """Return what a row of results/detections.csv says."""
    predicted_mm = row["predicted_mm"]
    if not words.is_known(predicted_mm):
        return Found("no verdict", reason=_reason(row))
    chance = row["probability"]
    probability, chance = words.probability(chance), _or_zero(chance)
    if predicted_mm == 0:
        return Found("no nodule", probability=probability, chance=chance)
    place = words.place(row["location_s"], row["location_mm"])
    return Found("nodule", _size(row), place, probability=probability, chance=chance)


def of_site(row: Row) -> Found:
    """Return what a row of results/sites.csv says; a site has no probability."""
    if not words.is_known(row["detected"]):
        return Found("no verdict", reason=_reason(row))
    if str(row["detected"]) != "True":
        return Found("no nodule")
    where = row["location_mm"]
    place = f"{words.number(where, 1)} mm" if words.is_known(where) else words.NOT_GIVEN
    return Found("nodule", _size(row), place)


def others_words(verdict: Found, others: Mapping[str, Found]) -> str:
    """Return in short how many other detectors agree, and what those say that do not.

    Parameters
    ----------
    verdict : Found
        Of the leading detector.
    others : mapping of str to Found
        Of each other detector.
    """
    differing = {name: each for name, each in others.items() if each.kind != verdict.kind}
    if verdict.kind == "no verdict":
        return "; ".join(f"{name}: {each.kind}" for name, each in differing.items())
    if not others:
        return ""
    agree = f"{words.count_of(len(others) - len(differing), len(others))} agree"
    return "; ".join([agree, *(f"{name}: {each.kind}" for name, each in differing.items())])


def _counts(rows: Sequence[Row], lead: str, *, sites: bool) -> str:
    if not rows:
        return ""
    several = [sum(row["kind"] == kind for row in rows) for kind in _ORDER]
    kind = "unlabelled recording"
    names = (f"{kind} or site", f"{kind}s and sites") if sites else (kind, f"{kind}s")
    what = words.plural(len(rows), *names)
    sentence = f"Of {what}, {lead} finds a nodule in {several[0]} and none in {several[2]}."
    return sentence + (f" On {several[1]} it gives no verdict." if several[1] else "")


def _size(row: Row) -> str:
    """Write a nodule's size; a detector may give one without an interval, or none."""
    size = words.estimated_size(row)
    known, bounded = words.is_known(row["estimate_mm"]), words.is_known(row["estimate_low_mm"])
    return f"{size}, no interval" if known and not bounded else size


def _reason(row: Row) -> str:
    reason = row.get("no_verdict")
    return str(reason) if words.is_known(reason) else ""


def _or_zero(value: float) -> float:
    return float(value) if words.is_known(value) else 0.0
