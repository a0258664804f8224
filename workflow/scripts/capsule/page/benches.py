"""Show how much a detector's rates differ between simulated benches."""

from collections.abc import Sequence

from capsule import words
from capsule.kinds import Cells, Row

# The part of a bench that neither taught a detector nor chose anything about it.
JUDGED_ONLY = "judged only"
RATES = ("specificity", "recall at 1 mm", "recall from 2 mm")


def page_values(rows: Sequence[Row], detectors: Sequence[str], origin: str) -> Cells:
    """Return what the page says about other benches.

    Parameters
    ----------
    rows : sequence of mapping
        Each detector's worst, middle and best bench, from workflow/report/benches.csv. Those whose
        ``part`` is not `JUDGED_ONLY` are left out.
    detectors : sequence of str
        The detectors that judge this archive.
    origin : str
        Kind of origin of the labelled recordings, from `capsule.page.provenance.Origin`.

    Returns
    -------
    dict
        ``bench_rows`` with ``detector``, ``which``, ``bench`` and the formatted ``rates``, and
        ``on_other_benches``, a text.
    """
    ranges = [
        row for row in rows if row["detector"] in detectors and row.get("part") == JUDGED_ONLY
    ]
    return {
        "bench_rows": [
            {
                "detector": row["detector"],
                "which": row["of the benches the"],
                "bench": row["bench"],
                "rates": [words.percent(float(row[name])) for name in RATES],
            }
            for row in ranges
        ],
        "on_other_benches": _in_sentences(ranges, origin),
    }


def _in_sentences(ranges: Sequence[Row], origin: str) -> str:
    """Return each detector's range over the benches in words; empty without benches."""
    clauses = []
    for detector in dict.fromkeys(row["detector"] for row in ranges):
        reached = {
            row["of the benches the"]: words.percent(float(row["recall from 2 mm"]))
            for row in ranges
            if row["detector"] == detector
        }
        least = [
            words.percent(float(row["specificity"]))
            for row in ranges
            if row["detector"] == detector and row["of the benches the"] == "least specific"
        ]
        at = f", with a specificity from {least[0]} on" if least else ""
        clauses.append(f"{detector} {reached['worst']} to {reached['best']}{at}")
    if not clauses:
        return ""
    simulated = (
        "On other simulated benches, which taught and chose nothing, the detectors found these "
        f"shares of the nodules from 2 mm on: {'; '.join(clauses)}."
    )
    if origin == "simulated":
        return f"Rates differ from bench to bench. {simulated}"
    return (
        f"Not of this archive: {simulated[0].lower()}{simulated[1:]} They show how much rates "
        "differ from bench to bench, and say nothing about the bench of this archive."
    )
