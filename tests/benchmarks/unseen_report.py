"""Write what judge_unseen.py has measured: tables, and the passages of documents that show them."""

import re
from collections.abc import Mapping, Sequence

import numpy as np
from judge_rates import error_row, mean_row, table
from judged_only import BENCHES as JUDGED_ONLY_BENCHES
from unseen_archives import (
    FIRST_FRESH_SEED,
    FIRST_SEED,
    FRESH,
    HAD_A_PART,
    JUDGED_ONLY,
    PARTS,
    part_of,
)

# Last the one that is our best.
DETECTORS = ("diagonal", "taught")
SHOWN = ("specificity", "recall at 1 mm", "recall from 2 mm")
FOUND = SHOWN[2]
LEAST = "least specific"
# The rows of every archive, by bench and detector.
Judged = Mapping[str, Mapping[str, Sequence[Mapping]]]


def _means(judged: Judged, detector: str, part: str | None = None) -> list[dict]:
    """Return the means of a detector on the benches of a part, the worst bench first."""
    means = [
        mean_row({"bench": bench, "part": part_of(bench)}, of_bench[detector])
        for bench, of_bench in judged.items()
        if of_bench.get(detector) and part in (None, part_of(bench))
    ]
    return sorted(means, key=lambda row: row["recall from 2 mm"])


def _detectors(judged: Judged) -> list[str]:
    """Return the detectors that have judged."""
    return [name for name in DETECTORS if any(of.get(name) for of in judged.values())]


def range_rows(judged: Judged) -> list[dict]:
    """Return each detector's worst, middle and best bench of each part, as the report reads them.

    The order is by recall from 2 mm on. The bench with the lowest specificity has a row of its own,
    since it need not be the worst one. Rates are rounded as tables show them.
    """
    rows = []
    for detector in _detectors(judged):
        for part in PARTS:
            means = _means(judged, detector, part)
            chosen = {"worst": 0, "middle": (len(means) - 1) // 2, "best": len(means) - 1}
            chosen |= {LEAST: int(np.argmin([row["specificity"] for row in means] or [0]))}
            if len(means) == 1:
                chosen = {"only": 0}
            for label, place in chosen.items() if means else ():
                row = means[place]
                label_cells = {"detector": detector, "part": part, "of the benches the": label}
                rates = {name: round(float(f"{100 * row[name]:.1f}") / 100, 3) for name in SHOWN}
                rows.append(label_cells | {"bench": row["bench"]} | rates)
    return rows


def bench_rows(judged: Judged) -> list[dict]:
    """Return the mean rates of every detector on every bench, the worst of each part first."""
    detectors = _detectors(judged)
    rows = []
    for part in PARTS:
        for bench in [row["bench"] for row in _means(judged, detectors[-1], part)]:
            for detector in detectors:
                if each := judged[bench][detector]:
                    label = {"part": part, "bench": bench, "archives": str(len(each))}
                    rows.append(mean_row(label | {"detector": detector}, each))
    return rows


def parts_rows() -> list[dict]:
    """Return which benches had which part; benches with the same part share a row."""
    shared: dict[tuple[str, str], list[str]] = {}
    for bench, did in HAD_A_PART.items():
        shared.setdefault(did, []).append(f"`{bench}`")
    rows = [
        {"bench": ", ".join(benches), "taught": taught, "chose": chose, "judged only": ""}
        for (taught, chose), benches in shared.items()
    ]
    only = ", ".join(f"`{bench}`" for bench in JUDGED_ONLY_BENCHES)
    return [*rows, {"bench": only, "taught": "", "chose": "", "judged only": "yes"}]


def _whole(row: Mapping, name: str) -> str:
    return f"{100 * float(row[name]):.0f} %"


def sentences(judged: Judged) -> str:
    """Return what the tables say of the best detector, as a list in Markdown."""
    detector = _detectors(judged)[-1]
    only = _means(judged, detector, JUDGED_ONLY)
    every = _means(judged, detector)
    errors = [error_row({}, of[detector]) for of in judged.values() if len(of[detector]) > 1]
    lines = []
    if only:
        lines.append(
            f"- Over the {len(only)} benches that judge only, `{detector}` finds "
            f"{_between(only, 'recall from 2 mm')} of the nodules from 2 mm on, the least on "
            f"`{only[0]['bench']}`, and {_between(only, 'recall at 1 mm')} of those of 1 mm. "
            f"Its specificity is {_between(only, 'specificity')} on fresh healthy recordings, "
            f"the least on `{min(only, key=lambda row: row['specificity'])['bench']}`."
        )
    lines.append(
        f"- The target of the specificity is 95 %. On all benches, that of `{detector}` is "
        f"{_between(every, 'specificity')} on fresh healthy recordings."
    )
    lines.append(
        "- The target of the size intervals is 90 %. On all benches, "
        f"{_between(every, 'intervals that hold the size')} of those of `{detector}` hold the size."
    )
    most = max(every, key=lambda row: row["no verdict"])
    lines.append(
        "- A recording without a verdict counts as a failure, with a nodule and without. These are "
        f"at most {100 * most['no verdict']:.1f} % of the recordings (`{most['bench']}`)."
    )
    others = [name for name in _detectors(judged) if name != detector]
    if others:
        lines.append(_fewer_than(judged, detector, others[-1]))
    if errors:
        largest = {name: max(error[name] for error in errors) for name in SHOWN}
        lines.append(
            "- The luck of the archives (standard error) is at most "
            f"{100 * largest['specificity']:.1f} points of specificity, "
            f"{100 * largest['recall from 2 mm']:.1f} from 2 mm on and "
            f"{100 * largest['recall at 1 mm']:.1f} at 1 mm."
        )
    return "\n".join(lines) + "\n"


def _fewer_than(judged: Judged, detector: str, other: str) -> str:
    """Return where a detector finds fewer nodules from 2 mm on than another one."""
    found = {
        name: {row["bench"]: row["recall from 2 mm"] for row in _means(judged, name)}
        for name in (detector, other)
    }
    fewer = {
        bench: 100 * (found[other][bench] - found[detector][bench])
        for bench in found[detector]
        if f"{found[detector][bench]:.3f}" < f"{found[other][bench]:.3f}"
    }
    if not fewer:
        return f"- `{detector}` finds as many nodules from 2 mm on as `{other}` or more everywhere."
    benches = ", ".join(f"`{bench}` ({points:.1f} points)" for bench, points in fewer.items())
    return f"- `{detector}` finds fewer nodules from 2 mm on than `{other}` on {benches}."


def _between(means: Sequence[Mapping], name: str) -> str:
    values = [100 * row[name] for row in means]
    return f"{min(values):.1f} to {max(values):.1f} %"


def whole_report(judged: Judged, effort: int) -> str:
    """Return the whole document; the paper's margin had fits of `effort` particles."""
    return (
        "# What the detectors reach on other benches\n\nMade by "
        "`tests/benchmarks/judge_unseen.py`; studies/detection.md tells why. Means over archives "
        f"of simulated recordings, seeds from {FIRST_SEED} on, place by place. *Specificity*: on "
        f"{FRESH} fresh healthy recordings for each archive, seeds from {FIRST_FRESH_SEED} on (of "
        "a stored bench: the healthy ones of its next archives). *Left out*: on the archive's own "
        "healthy recordings; the rank of a threshold sets it. A recording without a verdict is a "
        f"failure. The paper's margin: fits of {effort} particles and iterations.\n\n"
        f"## Which bench had which part\n\n{table(parts_rows())}\n"
        f"## The range\n\n{table(range_rows(judged))}\n"
        "## Bench by bench\n\nThe benches that judge only first, and of each part the worst first."
        f"\n\n{table(bench_rows(judged))}"
    )


def page_blocks(judged: Judged) -> dict[str, str]:
    """Return the passages of documents that show what was measured, by name."""
    ranges = range_rows(judged)
    return {
        "parts": table(parts_rows()),
        "ranges": table(ranges),
        "judged only": table([_shown(row) for row in bench_rows(judged) if _only(row)]),
        "sentences": sentences(judged),
    }


def _only(row: Mapping) -> bool:
    return row["part"] == JUDGED_ONLY


def _shown(row: Mapping) -> dict:
    return {name: row[name] for name in ("bench", "detector", *SHOWN)}


def filled_page(page: str, blocks: Mapping[str, str], program: str = "judge_unseen") -> str:
    """Return a document with each passage between its marks written anew.

    The marks of a passage are ``<!-- PROGRAM: NAME -->`` and ``<!-- end: NAME -->``.
    """
    for name, block in blocks.items():
        begin, end = f"<!-- {program}: {name} -->", f"<!-- end: {name} -->"
        between = re.compile(f"{re.escape(begin)}.*?{re.escape(end)}", re.DOTALL)
        marked = f"{begin}\n{block}\n{end}"
        page = between.sub(lambda _, text=marked: text, page)
    return page
