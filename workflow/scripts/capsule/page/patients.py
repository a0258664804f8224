"""List the verdicts on patients: unlabelled recordings, and sites with several passes."""

from collections.abc import Mapping, Sequence

import pandas as pd

from capsule import words
from capsule.evaluation.intervals import rate
from capsule.kinds import Cells, Row
from capsule.page.answers import Estimate
from capsule.page.rates import sets_specificity
from capsule.recordings.names import UNLABELLED, folder_of

# Rows that are visible at once; the page folds the others away.
SHOWN = 20
# With more patients than this, the table alone tells their verdicts.
MOST_SENTENCES = 6
# Nodules come first. Patients without a verdict come before healthy ones.
_ORDER = ("nodule", "no verdict", "no nodule")


# What the page shows of a patient without a verdict. ``chance`` is the probability as a number to
# sort by, ``unlike`` says why the patient is unlike the recordings that teach.
_NOTHING: Cells = {
    "kind": "no verdict",
    "verdict": "no verdict",
    "size": words.NOT_APPLICABLE,
    "place": words.NOT_APPLICABLE,
    "probability": words.NOT_GIVEN,
    "chance": 0.0,
    "sentence": "no verdict.",
    "unlike": "",
}


def page_values(
    index: pd.DataFrame,
    detections: pd.DataFrame,
    sites: pd.DataFrame,
    lead: str,
    qualities: Mapping[str, str],
    largest_mm: float,
) -> Cells:
    """Return the verdicts of the first screen.

    Parameters
    ----------
    index, detections, sites : DataFrame
        results/recordings.csv, detections.csv and sites.csv.
    lead : str
        The detector whose verdict is shown; of the others the page shows only whether they agree.
    qualities : mapping of str to str
        The quality of each accepted recording in words.
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
    rows = []
    accepted = index[index["status"] == "accepted"]
    unlabelled = accepted[accepted["size_mm"].isna()]
    of_sites: set[str] = set()
    for site, verdicts in sites[sites["size_mm"].isna()].groupby("site", sort=False):
        names = list(unlabelled.loc[unlabelled["site"] == site, "recording"])
        of_sites.update(names)
        told = {row["detector"]: verdict_of(row, largest_mm) for row in verdicts.to_dict("records")}
        passes = dict(zip(verdicts["detector"], verdicts["passes"], strict=True))
        each = {name: qualities[name] for name in names}
        said = [f"{_label(name)}: {text}" for name, text in each.items()]
        together = "; ".join(said) if len(set(each.values())) > 1 else next(iter(each.values()), "")
        row = _row(str(site), names, told, lead, together)
        rows.append(row | {"site": True, "passes": int(passes.get(lead, len(names)))})
    single = set(unlabelled["recording"]) - of_sites
    judged: dict[str, dict[str, Cells]] = {}
    for row in detections.to_dict("records"):
        judged.setdefault(row["recording"], {})[row["detector"]] = verdict_of(row, largest_mm)
    for name, status, reason in index[["recording", "status", "reason"]].itertuples(index=False):
        if status != "accepted" and folder_of(name) == UNLABELLED:
            rejected = _NOTHING | {"sentence": f"no verdict. Rejected: {reason}."}
            rows.append(_row(_label(name), [], {lead: rejected}, lead, f"rejected: {reason}"))
        elif name in single:
            rows.append(_row(_label(name), [name], judged.get(name, {}), lead, qualities[name]))
    rows.sort(key=lambda row: (_ORDER.index(row["kind"]), -row["chance"]))
    few = len(rows) <= MOST_SENTENCES
    return {
        "rows": rows[:SHOWN],
        "folded": rows[SHOWN:],
        "unknown_kind": _unknown_kind(detections),
        "counts": _counts(rows, lead, sites=bool(of_sites)) if len(rows) > 1 else "",
        "sentences": [(row["patient"], row["sentence"]) for row in rows] if few else [],
    }


def together_values(
    rows: Sequence[Row], retest: pd.DataFrame, schemes: Sequence[str], confidence: float
) -> list[Cells]:
    """Return how often verdicts on several passes together are right.

    Parameters
    ----------
    rows : sequence of mapping
        Rows of `page_values`: ``site``, whether passes were judged together, and
        ``passes``, how many.
    retest : DataFrame
        The detector's rates by the number of passes.
    schemes : sequence of str
        The schemes in the order of the page; the first of the table counts.
    confidence : float
        Level of the intervals.

    Returns
    -------
    list of dict
        For each number of ``passes`` the ``scheme``; ``nodules``, the places with a nodule of
        ``sizes_mm`` that were found; ``healthy``, the healthy places at which one was reported;
        and ``learned``, whether the threshold sets this rate. None if there is no such place.
    """
    # A table without rows has none of the schemes.
    scheme = next((name for name in schemes if (retest["scheme"] == name).any()), schemes[0])
    told = []
    for passes in sorted({row["passes"] for row in rows if row["site"]}):
        judged = retest[(retest["scheme"] == scheme) & (retest["passes"] == passes)]
        nodules, healthy = judged[judged["size_mm"] > 0], judged[judged["size_mm"] == 0]
        told.append(
            {
                "passes": passes,
                "scheme": scheme,
                "nodules": _together(nodules, confidence),
                "sizes_mm": sorted(nodules["size_mm"]),
                "healthy": _together(healthy, confidence),
                "learned": any(sets_specificity(each, scheme) for each in healthy["detector"]),
            }
        )
    return told


def _together(rows: pd.DataFrame, confidence: float) -> Estimate | None:
    """Return the rate over all sizes; each place has one verdict."""
    if rows.empty:
        return None
    of = int(rows["sites"].sum())
    hits = round(float((rows["detected"] * rows["sites"]).sum()))
    return Estimate(*rate(hits, of, confidence), hits, of)


def _row(
    patient: str, names: Sequence[str], verdicts: Mapping[str, Cells], lead: str, quality: str
) -> Cells:
    verdict = verdicts.get(lead, _NOTHING)
    unlike, sentence = verdict["unlike"], verdict["sentence"]
    warned = f"{words.UNLIKE}: {unlike}. If it is judged all the same: {sentence}"
    return {
        **verdict,
        "patient": patient,
        "site": False,
        "passes": len(names),
        "recordings": [{"name": name, "label": _label(name)} for name in names],
        "sentence": warned if unlike else sentence,
        "quality": f"{unlike}; {quality}" if unlike else quality,
        "others": _others(verdict, [name for name in verdicts if name != lead], verdicts),
    }


def _label(name: str) -> str:
    """Return an unlabelled recording's name without the folder that all of them share."""
    return name.removeprefix(f"{UNLABELLED}/")


def verdict_of(row: Row, largest_mm: float) -> Cells:
    """Return the verdict in a row of results/detections.csv or sites.csv.

    Parameters
    ----------
    row : mapping
        The row; that of a site has ``passes``, and no probability.
    largest_mm : float
        The largest size that the archive holds.
    """
    of_site = "passes" in row
    found = row["detected"] if of_site else row["predicted_mm"]
    if not words.is_known(found):
        return _none(row)
    stated = None if of_site else words.stated_probability(row)
    probability, known = words.probability(stated), words.is_known(stated)
    passes = words.plural(int(row["passes"]), "pass", "passes") if of_site else ""
    score = _score_words(row, f"the mean score of {passes}" if of_site else "its score")
    told = _NOTHING | {"probability": probability, "unlike": words.unlike_because(row)}
    told["chance"] = float(stated) if words.is_known(stated) else 0.0
    if found == 0 or str(found) == "False":
        of_nodule = f"; probability of a nodule {probability}" if known else ""
        sentence = f"no nodule found{score}{of_nodule}."
        return told | {"kind": "no nodule", "verdict": "no nodule", "sentence": sentence}
    where = row["location_mm"]
    at = f"{words.number(where, 1)} mm" if words.is_known(where) else words.NOT_GIVEN
    return told | {
        "kind": "nodule",
        "verdict": "nodule",
        "size": _size(row, largest_mm),
        "place": at if of_site else words.place(row["location_s"], where),
        "sentence": _nodule_words(
            row, largest_mm, [f"probability {probability}"] if known else [], score
        ),
    }


def _none(row: Row) -> Cells:
    reason = row.get("no_verdict")
    verdict = f"no verdict: {reason}" if words.is_known(reason) and reason else "no verdict"
    return _NOTHING | {
        "verdict": verdict,
        "sentence": f"{words.verdict({**row, 'predicted_mm': None})}.",
    }


def _nodule_words(row: Row, largest_mm: float, given: Sequence[str], score: str) -> str:
    """Return a nodule in one sentence: size with interval, place, probability and score."""
    size = _size(row, largest_mm)
    said = ["a nodule" if size == words.NOT_GIVEN else f"a nodule of about {size}"]
    ways = ((row["location_mm"], "mm along the way"), (row.get("location_s"), "s into the run"))
    known = [(value, where) for value, where in ways if words.is_known(value)]
    if known:
        value, where = known[0]
        said.append(f"{words.number(value, 0)} {where}" if value >= 0 else "before the start")
    return f"{', '.join([*said, *given])}{score}."


def _score_words(row: Row, what: str) -> str:
    """Return how a score compares with its threshold; empty if either is not known."""
    score, threshold = row.get("score"), row.get("threshold")
    if not words.is_known(score) or not words.is_known(threshold):
        return ""
    verb = "exceeds" if score > threshold else "does not exceed"
    limit = words.significant(threshold)
    return f"; {what}, {words.significant(score)}, {verb} the threshold of {limit}"


def _others(verdict: Row, names: Sequence[str], verdicts: Mapping[str, Row]) -> str:
    """Return how many other detectors agree, and the verdicts of those that do not."""
    kinds = {name: verdicts[name]["kind"] for name in names}
    said = [f"{name}: {kind}" for name, kind in kinds.items() if kind != verdict["kind"]]
    if names and verdict["kind"] != "no verdict":
        said.insert(0, f"{words.count_of(len(names) - len(said), len(names))} agree")
    return "; ".join(said)


def _counts(rows: Sequence[Row], lead: str, *, sites: bool) -> str:
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


def _size(row: Row, largest_mm: float) -> str:
    """Return a nodule's size in words; a size may lack an interval, or be missing."""
    size = words.estimated_size(row, largest_mm)
    known, bounded = words.is_known(row["estimate_mm"]), words.is_known(row["estimate_low_mm"])
    return f"{size}, no interval" if known and not bounded else size
