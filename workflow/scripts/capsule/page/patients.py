"""List the verdicts on patients: unlabelled recordings, and sites with several passes."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import pandas as pd

from capsule import words
from capsule.kinds import Cells, Row
from capsule.names import UNLABELLED, folder_of

# Rows that are visible at once; the page folds the others away.
SHOWN = 20
# With more patients than this, the table alone tells their verdicts.
MOST_SENTENCES = 6
# Nodules come first. Patients without a verdict come before healthy ones.
_ORDER = ("nodule", "no verdict", "no nodule")


@dataclass(frozen=True)
class Found:
    """A detector's verdict on a patient, in words.

    Attributes
    ----------
    kind : {"nodule", "no nodule", "no verdict"}
    size, place, probability : str
        The values in words.
    reason : str
        Why there is no verdict, if the detector gives a reason.
    chance : float
        The probability as a number to sort by; 0 if there is none.
    sentence : str
        All of it in one sentence.
    unlike : str
        Why the patient is unlike the recordings that teach; else empty.
    """

    kind: str
    size: str = words.NOT_APPLICABLE
    place: str = words.NOT_APPLICABLE
    probability: str = words.NOT_GIVEN
    reason: str = ""
    chance: float = 0.0
    sentence: str = "no verdict."
    unlike: str = ""

    def text(self) -> str:
        """Return the kind of verdict, with the reason if there is one."""
        return f"{self.kind}: {self.reason}" if self.reason else self.kind


def page_values(
    index: pd.DataFrame,
    detections: pd.DataFrame,
    sites: pd.DataFrame,
    lead: str,
    quality: Callable[[str], str],
    largest_mm: float,
) -> Cells:
    """Return the verdicts of the first screen.

    Parameters
    ----------
    index, detections, sites : DataFrame
        results/recordings.csv, detections.csv and sites.csv.
    lead : str
        The detector whose verdict is shown; of the others the page shows only whether they agree.
    quality : callable
        ``quality(name)`` returns the quality of an accepted recording in words.
    largest_mm : float
        The largest size that the archive holds.

    Returns
    -------
    dict
        ``rows`` and ``folded``, nodules first, with ``patient``, ``site``, ``passes``,
        ``recordings``, ``unlike``, ``kind``, ``verdict``, ``size``, ``place``, ``probability``,
        ``quality`` and ``others``; ``unknown_kind``, why nobody can tell who is unlike;
        ``counts``, one or two sentences on many patients; and ``sentences``, pairs of a patient and
        the verdict, for few. There is no row if no recording is unlabelled.
    """
    rows = [*_site_rows(index, sites, lead, quality, largest_mm)]
    of_sites = {each["name"] for row in rows for each in row["recordings"]}
    rows += _recording_rows(index, detections, lead, quality, of_sites, largest_mm)
    rows.sort(key=lambda row: (_ORDER.index(row["kind"]), -row["chance"]))
    few = len(rows) <= MOST_SENTENCES
    return {
        "rows": rows[:SHOWN],
        "folded": rows[SHOWN:],
        "unknown_kind": _unknown_kind(detections),
        "counts": _counts(rows, lead, sites=bool(of_sites)) if len(rows) > 1 else "",
        "sentences": [(row["patient"], row["sentence"]) for row in rows] if few else [],
    }


def _recording_rows(
    index: pd.DataFrame,
    detections: pd.DataFrame,
    lead: str,
    quality: Callable[[str], str],
    of_sites: set[str],
    largest_mm: float,
) -> Iterator[Cells]:
    """Yield one row per unlabelled recording, except those of a site that has its own row."""
    verdicts: dict[str, dict[str, Found]] = {}
    for row in detections.to_dict("records"):
        verdicts.setdefault(row["recording"], {})[row["detector"]] = of_recording(row, largest_mm)
    for row in index.to_dict("records"):
        name = row["recording"]
        if row["status"] == "accepted" and not words.is_known(row["size_mm"]):
            if name not in of_sites:
                yield _row(_label(name), [name], verdicts.get(name, {}), lead, quality(name))
        elif row["status"] != "accepted" and folder_of(name) == UNLABELLED:
            rejected = Found("no verdict", sentence=f"no verdict. Rejected: {row['reason']}.")
            yield _row(_label(name), [], {lead: rejected}, lead, f"rejected: {row['reason']}")


def _site_rows(
    index: pd.DataFrame,
    sites: pd.DataFrame,
    lead: str,
    quality: Callable[[str], str],
    largest_mm: float,
) -> Iterator[Cells]:
    """Yield one row per unlabelled site that was passed several times."""
    unlabelled = index[(index["status"] == "accepted") & index["size_mm"].isna()]
    for site, rows in sites[sites["size_mm"].isna()].groupby("site", sort=False):
        names = list(unlabelled.loc[unlabelled["site"] == site, "recording"])
        verdicts = {row["detector"]: of_site(row, largest_mm) for row in rows.to_dict("records")}
        passes = {row["detector"]: int(row["passes"]) for row in rows.to_dict("records")}
        each = {name: quality(name) for name in names}
        said = [f"{_label(name)}: {text}" for name, text in each.items()]
        together = "; ".join(said) if len(set(each.values())) > 1 else next(iter(each.values()), "")
        row = _row(str(site), names, verdicts, lead, together, site=True)
        yield row | {"passes": passes.get(lead, len(names))}


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
        "passes": len(names),
        "recordings": [{"name": name, "label": _label(name)} for name in names],
        "kind": verdict.kind,
        "unlike": verdict.unlike,
        "verdict": verdict.text(),
        "sentence": _after(verdict.unlike, verdict.sentence),
        "size": verdict.size,
        "place": verdict.place,
        "probability": verdict.probability,
        "chance": verdict.chance,
        "quality": f"{verdict.unlike}; {quality}" if verdict.unlike else quality,
        "others": others_words(verdict, {n: v for n, v in verdicts.items() if n != lead}),
    }


def _label(name: str) -> str:
    """Return an unlabelled recording's name without the folder that all of them share."""
    return name.removeprefix(f"{UNLABELLED}/")


def of_recording(row: Row, largest_mm: float) -> Found:
    """Return the verdict in a row of results/detections.csv."""
    if not words.is_known(row["predicted_mm"]):
        return _none(row)
    stated, unlike = words.stated_probability(row), words.unlike_because(row)
    probability, chance = words.probability(stated), _or_zero(stated)
    given = [f"probability {probability}"] if words.is_known(stated) else []
    score = _score_words(row, "its score")
    if row["predicted_mm"] == 0:
        of_nodule = f"; probability of a nodule {probability}" if given else ""
        sentence = f"no nodule found{score}{of_nodule}."
        return Found(
            "no nodule", probability=probability, chance=chance, sentence=sentence, unlike=unlike
        )
    size, place = _size(row, largest_mm), words.place(row["location_s"], row["location_mm"])
    sentence = _nodule_words(size, row, given, score)
    return Found("nodule", size, place, probability, "", chance, sentence, unlike)


def of_site(row: Row, largest_mm: float) -> Found:
    """Return the verdict in a row of results/sites.csv; a site has no probability."""
    if not words.is_known(row["detected"]):
        return _none(row)
    score = _score_words(
        row, f"the mean score of {words.plural(int(row['passes']), 'pass', 'passes')}"
    )
    if str(row["detected"]) != "True":
        sentence = f"no nodule found{score}."
        return Found("no nodule", sentence=sentence, unlike=words.unlike_because(row))
    where = row["location_mm"]
    place = f"{words.number(where, 1)} mm" if words.is_known(where) else words.NOT_GIVEN
    size = _size(row, largest_mm)
    sentence = _nodule_words(size, row, [], score)
    return Found("nodule", size, place, sentence=sentence, unlike=words.unlike_because(row))


def _none(row: Row) -> Found:
    reason = row.get("no_verdict")
    why = str(reason) if words.is_known(reason) and reason else ""
    return Found(
        "no verdict", reason=why, sentence=f"{words.verdict({**row, 'predicted_mm': None})}."
    )


def _nodule_words(size: str, row: Row, given: Sequence[str], score: str) -> str:
    """Return a nodule in one sentence: size with interval, place, probability and score."""
    what = "a nodule" if size == words.NOT_GIVEN else f"a nodule of about {size}"
    way_mm, seconds = row["location_mm"], row.get("location_s")
    where = []
    if words.is_known(way_mm):
        where = [
            f"{words.number(way_mm, 0)} mm along the way" if way_mm >= 0 else "before the start"
        ]
    elif words.is_known(seconds):
        where = [
            f"{words.number(seconds, 0)} s into the run" if seconds >= 0 else "before the start"
        ]
    return f"{', '.join([what, *where, *given])}{score}."


def _score_words(row: Row, what: str) -> str:
    """Return how a score compares with its threshold; empty if either is not known."""
    score, threshold = row.get("score"), row.get("threshold")
    if not words.is_known(score) or not words.is_known(threshold):
        return ""
    verb = "exceeds" if score > threshold else "does not exceed"
    limit = words.significant(threshold)
    return f"; {what}, {words.significant(score)}, {verb} the threshold of {limit}"


def others_words(verdict: Found, others: Mapping[str, Found]) -> str:
    """Return how many other detectors agree, and the verdicts of those that do not.

    Parameters
    ----------
    verdict : Found
        The leading detector's verdict.
    others : mapping of str to Found
        The verdict of each other detector.
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
    sentence += f" On {several[1]} it gives no verdict." if several[1] else ""
    unlike = sum(bool(row["unlike"]) for row in rows)
    told = f" {words.UNLIKE.capitalize()}: {words.count_of(unlike, len(rows))}."
    return sentence + (told if unlike else "")


def _unknown_kind(detections: pd.DataFrame) -> str:
    """Return why nobody can tell which recordings are of the kind that teaches, if so."""
    told = detections.reindex(columns=["familiar", "unfamiliar_because"])
    unknown = told.loc[told["familiar"].isna(), "unfamiliar_because"].dropna()
    return str(unknown.iloc[0]) if len(unknown) else ""


def _after(unlike: str, sentence: str) -> str:
    """Return a verdict after the warning that it is on a recording of another kind, if it is."""
    told = f"{words.UNLIKE}: {unlike}. If it is judged all the same: {sentence}"
    return told if unlike else sentence


def _size(row: Row, largest_mm: float) -> str:
    """Return a nodule's size in words; a size may lack an interval, or be missing."""
    size = words.estimated_size(row, largest_mm)
    known, bounded = words.is_known(row["estimate_mm"]), words.is_known(row["estimate_low_mm"])
    return f"{size}, no interval" if known and not bounded else size


def _or_zero(value: float | None) -> float:
    return float(value) if words.is_known(value) else 0.0
