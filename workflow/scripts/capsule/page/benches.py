"""Show how much a detector's rates differ between simulated benches."""

from collections.abc import Sequence

from capsule import words
from capsule.kinds import Cells, Row


def page_values(rows: Sequence[Row], detectors: Sequence[str]) -> Cells:
    """Return what the page says about other benches.

    Parameters
    ----------
    rows : sequence of mapping
        Each detector's worst, middle and best bench, from workflow/report/benches.csv.
    detectors : sequence of str
        The detectors that judge this archive.

    Returns
    -------
    dict
        ``bench_rows`` with ``detector``, ``which``, ``bench`` and the formatted ``rates``, and
        ``on_other_benches``, a text.
    """
    ranges = [row for row in rows if row["detector"] in detectors]
    return {
        "bench_rows": [
            {
                "detector": row["detector"],
                "which": row["of the benches the"],
                "bench": row["bench"],
                "rates": [
                    words.percent(float(row[name]))
                    for name in ("specificity", "recall at 1 mm", "recall from 2 mm")
                ],
            }
            for row in ranges
        ],
        "on_other_benches": _in_one_sentence(ranges),
    }


def _in_one_sentence(ranges: Sequence[Row]) -> str:
    """Return each detector's range over the benches in words; empty without benches."""
    clauses = []
    for detector in dict.fromkeys(row["detector"] for row in ranges):
        reached = {
            row["of the benches the"]: words.percent(float(row["recall from 2 mm"]))
            for row in ranges
            if row["detector"] == detector
        }
        clauses.append(f"{detector} {reached['worst']} to {reached['best']}")
    if not clauses:
        return ""
    return (
        "Rates differ from bench to bench. On other simulated benches that also explain the "
        "paper's table, the detectors find these shares of the nodules from 2 mm on: "
        f"{'; '.join(clauses)}."
    )
