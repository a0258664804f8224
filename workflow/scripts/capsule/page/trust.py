"""Write in words how far to trust a verdict, from the archive's labelled recordings."""

from collections.abc import Sequence

import pandas as pd

from capsule import words
from capsule.evaluation.cross_validation import HELD_OUT
from capsule.evaluation.intervals import rate
from capsule.kinds import Row, Settings
from capsule.page import cards
from capsule.page.answers import Answers, Estimate
from capsule.page.schemes import sets_specificity

_SAME_BENCH = "These rates hold for recordings of the same bench and capsule only."
_ORIGINS = {
    "simulated": (
        "The labelled recordings are simulated: these rates do not hold for a real capsule."
    ),
    "mixed": "Some of the labelled recordings are simulated: these rates hold for no single bench.",
}


def trust_words(ours: Answers) -> str:
    """Return sentences on how often a verdict on a single pass is right.

    Parameters
    ----------
    ours : Answers
        The detector's results on labelled recordings, each a single pass.
    """
    if ours.confounded:
        return (
            "These recordings cannot show how far to trust a verdict: among those that teach, "
            f"{ours.confounded}."
        )
    clauses = []
    if ours.found:
        sizes_mm = [each.size_mm for each in ours.found]
        clause = f"it found {_of(ours.any_size)} nodules of {_range(sizes_mm)} ("
        clause += _rate(ours.any_size)
        smallest = ours.found[0]
        if len(sizes_mm) > 1:
            clause += f"; of {words.size(smallest.size_mm)}: {_of(smallest.recall)}"
        clauses.append(f"{clause})")
    if ours.specificity.of and ours.set_specificity is None:
        clauses.append(
            f"it reported none in {_of(ours.specificity)} recordings without a nodule "
            f"(specificity {_rate(ours.specificity)})"
        )
    if not clauses:
        return (
            "This archive cannot show how far to trust a verdict, because no labelled recording "
            "was judged."
        )
    where = "On held-out sessions" if ours.scheme == HELD_OUT else "On this archive"
    by = "" if ours.scheme == HELD_OUT else f", by {words.scheme(ours.scheme)}"
    said = [f"{where}{by}, judging single passes, {' and '.join(clauses)}."]
    if ours.set_specificity is not None:
        wanted = words.percent(ours.set_specificity.wanted)
        said.append(
            f"Its specificity is set to {wanted} by the threshold, not measured. "
            f"{cards.set_words(ours.set_specificity)}"
        )
    return " ".join(said)


def of_rows(
    rows: Sequence[Row],
    single: str,
    retest: pd.DataFrame,
    schemes: Sequence[str],
    rules: Settings,
    origin: str,
) -> str:
    """Return sentences on the verdicts of a table: on single passes, and on several together.

    Parameters
    ----------
    rows : sequence of mapping
        Rows of `capsule.page.patients`: ``site``, whether passes were judged together, and
        ``passes``, how many.
    single : str
        From `trust_words`.
    retest : DataFrame
        The detector's rates by the number of passes.
    schemes : sequence of str
        The schemes in the order of the page; the first of the table counts.
    rules : mapping
        Section ``evaluation`` of the configuration.
    origin : str
        Kind of the labelled recordings' origin, from `capsule.page.provenance.Origin`.
    """
    said = [single] if not all(row["site"] for row in rows) else []
    together = sorted({row["passes"] for row in rows if row["site"]})
    # A table without rows has none of the schemes.
    scheme = next((name for name in schemes if (retest["scheme"] == name).any()), schemes[0])
    of_scheme = retest[retest["scheme"] == scheme]
    said += [_combined(of_scheme, scheme, each, rules) for each in together]
    return " ".join([*said, _ORIGINS.get(origin, _SAME_BENCH)])


def _combined(retest: pd.DataFrame, scheme: str, passes: int, rules: Settings) -> str:
    """Return a sentence on how often a verdict on several passes together is right."""
    rows = retest[retest["passes"] == passes]
    nodules, healthy = rows[rows["size_mm"] > 0], rows[rows["size_mm"] == 0]
    several = words.plural(passes, "pass", "passes")
    clauses = []
    if not nodules.empty:
        found = _together(nodules, rules["confidence"])
        sizes_mm = sorted(nodules["size_mm"])
        clauses.append(
            f"found {_of(found)} places with a nodule of {_range(sizes_mm)} ({_rate(found)})"
        )
    learned = not healthy.empty and sets_specificity(healthy["detector"].iloc[0], scheme)
    if not healthy.empty and not learned:
        alarms = _together(healthy, rules["confidence"])
        clauses.append(f"reported a nodule at {_of(alarms)} healthy places ({_rate(alarms)})")
    if not clauses:
        return (
            f"This archive has no rate for {several} judged together, so it cannot show how far to "
            "trust such a verdict."
        )
    sentence = (
        f"Judging {several} over a place together, by {words.scheme(scheme)}, it "
        f"{' and '.join(clauses)}."
    )
    if learned:
        wanted = words.percent(rules["specificity"])
        sentence += f" The specificity is set to {wanted} here too, and not measured."
    return sentence


def _together(rows: pd.DataFrame, confidence: float) -> Estimate:
    """Return the rate over all sizes; each place has one verdict."""
    of = int(rows["sites"].sum())
    hits = round(float((rows["detected"] * rows["sites"]).sum()))
    return Estimate(*rate(hits, of, confidence), hits, of)


def _of(estimate: Estimate) -> str:
    return words.count_of(estimate.hits, estimate.of)


def _rate(estimate: Estimate) -> str:
    return f"{words.percent(estimate.value)}, {cards.bounds(estimate)}"


def _range(sizes_mm: list[float]) -> str:
    if len(sizes_mm) == 1:
        return words.size(sizes_mm[0])
    return f"{sizes_mm[0]:g} to {words.size(sizes_mm[-1])}"
