"""The cards of the first screen: one a patient or place, or two examples of the archive."""

from collections import Counter
from collections.abc import Mapping, Sequence

import pandas as pd

from capsule import words
from capsule.detectors.unlike import unlike_because
from capsule.detectors.verdicts import VerdictWord, row_verdict
from capsule.kinds import Cells, Row
from capsule.page.packing import inflated
from capsule.page.sketches import felt_sketch, score_strip
from capsule.page.tables import Tables
from capsule.recordings.names import UNLABELLED, folder_of

# Patients with a card, and with a visible row after these; then a fold.
CARDS, LISTED = 6, 20
# A sensor that is pressed less deeply than this, in its usual depths, felt nothing unusual.
PRESSED = 1.25
_FOUND = (VerdictWord.NODULE, VerdictWord.UNCERTAIN)
_ORDER = list(VerdictWord)


def page_values(tables: Tables) -> Cells:
    """Return the page's cards, the first `CARDS` with drawings, and the counts of verdicts."""
    lead, described, verdicts = tables.lead.detector, tables.described, tables.by_recording
    known = tables.first_verdicts.query("detector == @lead").dropna(subset="score")
    known = known.sort_values("score", kind="stable")
    made = patient_cards(tables.index, verdicts, tables.sites, lead, described)
    made = made or example_cards(known[known["scheme"] == tables.schemes[0]], verdicts, lead)
    is_healthy = known["size_mm"] == 0
    scores = [known.loc[some, "score"].tolist() for some in (is_healthy, ~is_healthy)]
    counted = Counter(card["word"] for card in made)
    drawn = [with_sketches(card, described, *scores) for card in made[:CARDS]]
    return {
        "cards": drawn + made[CARDS:],
        "verdict_counts": [(str(word), counted[word]) for word in VerdictWord if counted[word]],
        "most_cards": CARDS,
        "most_listed": LISTED,
        "pressed": PRESSED,
    }


def patient_cards(
    index: pd.DataFrame,
    verdicts: Mapping[str, Sequence[Row]],
    sites: pd.DataFrame,
    lead: str,
    described: Mapping[str, Row],
) -> list[Cells]:
    """Return the verdicts on unlabelled recordings and places, the most urgent first.

    The leading detector's verdict is shown; of the others, whether they agree.
    """
    accepted = index[index["status"] == "accepted"]
    unlabelled = accepted[accepted["size_mm"].isna()]
    cards, of_sites = [], set()
    for site, rows in sites[sites["size_mm"].isna()].groupby("site", sort=False):
        names = list(unlabelled.loc[unlabelled["site"] == site, "recording"])
        of_sites.update(names)
        cards.append(_told(str(site), names, rows.to_dict("records"), lead, described))
    for name, status, reason in index[["recording", "status", "reason"]].itertuples(index=False):
        if folder_of(name) != UNLABELLED or name in of_sites:
            continue
        if status == "accepted":
            cards.append(_told(label_of(name), [name], verdicts.get(name, []), lead, described))
        else:
            rejected = {"detector": lead, "no_verdict": f"rejected: {reason}"}
            cards.append(_told(label_of(name), [], [rejected], lead, described))
    return sorted(cards, key=lambda card: (_ORDER.index(card["word"]), -card["chance"]))


def example_cards(
    known: pd.DataFrame, verdicts: Mapping[str, Sequence[Row]], lead: str
) -> list[Cells]:
    """Return cards of the nodule and of the healthy recording of the median score.

    They stand in for patients in an archive without any; ``example_of`` is the true size in words.
    The leading detector's known scores are ascending.
    """
    cards = []
    for some in (known[known["size_mm"] > 0], known[known["size_mm"] == 0]):
        if len(some):
            name = some["recording"].iloc[(len(some) - 1) // 2]
            card = _told(name, [name], verdicts[name], lead, {name: {"quality": ""}})
            cards.append(card | {"example_of": words.size(card["row"]["size_mm"])})
    return cards


def with_sketches(
    card: Cells,
    described: Mapping[str, Row],
    healthy: Sequence[float],
    nodules: Sequence[float],
) -> Cells:
    """Return a card with ``felt``, what each sensor felt, and ``strip``, its score among others.

    The scores of labelled places, which taught the detector nothing, are ascending. Without signals
    ``felt`` is None, without a score ``strip``.
    """
    drawn = inflated(described[card["names"][0]]["drawn"]) if card["names"] else None
    score, threshold = card["row"]["score"], card["row"]["threshold"]
    judged = words.is_known(score) and words.is_known(threshold)
    return card | {
        "felt": felt_sketch(drawn, diagonal=card["word"] in _FOUND) if drawn else None,
        "strip": score_strip(healthy, nodules, threshold, score) if judged else None,
    }


def label_of(name: str) -> str:
    """Return an unlabelled recording's name without the folder that all of them share."""
    return name.removeprefix(f"{UNLABELLED}/")


def _told(
    patient: str,
    names: Sequence[str],
    rows: Sequence[Row],
    lead: str,
    described: Mapping[str, Row],
) -> Cells:
    """Return the verdict on a patient or place, from the rows of its detectors.

    Passes judged together count as `passes`, a single recording as 0.
    """
    told = {row["detector"]: row for row in rows}
    row = {"score": None, "threshold": None, **told.get(lead, {})}
    word = row_verdict(row)
    row["probability"] = words.stated_probability(row)
    reason = row.get("no_verdict")
    found = word is not VerdictWord.NO_VERDICT and row["score"] > row["threshold"]
    others = [(name, row_verdict(each)) for name, each in told.items() if name != lead]
    faults = {label_of(name): fault for name in names if (fault := described[name]["quality"])}
    return {
        "patient": patient,
        "names": list(names),
        "word": word,
        "code": word.code,
        "found": found,
        "row": row,
        # Passes judged together have no probability: they stand before single ones.
        "chance": row["probability"] if words.is_known(row["probability"]) else float(found),
        "others": others,
        "agree": all((each in _FOUND) == (word in _FOUND) for _, each in others),
        "passes": int(row["passes"]) if "passes" in row else 0,
        "reason": unlike_because(row) or (reason if words.is_known(reason) else ""),
        "quality": "; ".join(
            f"{name}: {fault}" if len(names) > 1 else fault for name, fault in faults.items()
        ),
        "example_of": "",
    }
