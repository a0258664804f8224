"""Tell what the detector `taught` loses by its ranking and by its threshold.

    python tests/benchmarks/judge_thresholds.py --cache FOLDER --folders FOLDER/b FOLDER/b-clear
        --pages workflow/studies/detection.md

A threshold from few healthy recordings is luck. Compared with it are the true quantile of many, and
what thousands of recordings teach. threshold_rates.py says how all is measured.
"""

import argparse
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

FOLDERS = [Path(__file__).parents[2] / "workflow" / each for each in ("scripts", "studies")]
sys.path[:0] = map(str, FOLDERS)

from healthy_pools import Pool, pool_of
from judge_report import table
from judged_only import BENCHES as JUDGED_ONLY_BENCHES
from threshold_rates import ranking, ranking_by_many, verdicts
from unseen_archives import bench_names
from unseen_report import filled_page

from capsule.arguments import natural
from capsule.engine.configuration import read_config_file
from capsule.engine.project import CONFIG, WEIGHTS

HEALTHY = (20, 40, 80, 160)
LIMITS = Path(__file__).parents[2] / "workflow/studies/results/detection-limits.md"
# MiniRocket, taught by 2,400 recordings, as those tell who made them. They tell nothing of 4 and
# 5 mm on `b`, where at most all are found.
TOLD = {"b": [0.08, (0.60 + 0.96 + 1 + 1) / 4], "b-clear": [0.97, 1.0]}
# A bench is far from its limit at 1 mm if the verdicts of an archive find less than this share.
FAR = 0.75


class Losses(NamedTuple):
    """Shares of nodules found on a bench, at 1 mm and from 2 mm on.

    Attributes
    ----------
    limit
        By MiniRocket, which thousands teach.
    many, count
        By a regression on the features of `taught`, and how many recordings teach it.
    ranking
        By `taught`, which an archive teaches, at the true threshold.
    verdicts
        The same with its own threshold, and the specificity, by number of healthy recordings.
    """

    limit: list[float]
    many: list[float]
    count: int
    ranking: list[float]
    verdicts: Mapping[int, list[float]]


def limits(page: str) -> dict[str, list[float]]:
    """Return what MiniRocket finds on each bench, at 1 mm and from 2 mm on, from the page."""
    found = dict(TOLD)
    for line in page.splitlines():
        cells = [cell.strip() for cell in line.strip("|").split("|")]
        if cells[1:3] == ["MiniRocket", "10,000 others of the bench"]:
            found[cells[0]] = [float(cells[at].rstrip(" %")) / 100 for at in (4, -1)]
    return found


def losses_of(pool: Pool, limit: list[float], draws: int, config: Mapping) -> Losses:
    """Judge a bench by all thresholds."""
    many, count = ranking_by_many(pool, config)
    found = {each: verdicts(pool, each, draws, config) for each in HEALTHY}
    return Losses(limit, many, count, ranking(pool, config), found)


def losses_table(losses: Mapping[str, Losses]) -> str:
    """Return the table of all benches."""
    rows = []
    for bench, each in losses.items():
        row = {"bench": bench, "limit": _cell(each.limit)}
        row["features, by many"] = f"{_cell(each.many)} (by {each.count:,})"
        row["ranking, by 120"] = _cell(each.ranking)
        rows.append(row | {f"{n} healthy": _cell(found) for n, found in each.verdicts.items()})
    return table(rows)


def _cell(shares: Sequence[float]) -> str:
    return " / ".join(f"{100 * share:.0f}" for share in shares)


def answer(losses: Mapping[str, Losses]) -> str:
    """Return whether ranking or threshold costs more, as a list in Markdown."""
    least = min(HEALTHY)
    far = {
        bench: each
        for bench, each in losses.items()
        if each.verdicts[least][0] < FAR * each.limit[0] and bench not in TOLD
    }
    clauses = [
        f"`{bench}` {100 * (each.limit[0] - each.ranking[0]):.1f} and "
        f"{100 * (each.ranking[0] - each.verdicts[least][0]):.1f}"
        for bench, each in far.items()
    ]
    from_2_mm = [
        (100 * (each.limit[1] - each.ranking[1]), 100 * (each.ranking[1] - each.verdicts[least][1]))
        for each in losses.values()
    ]
    ranks, thresholds = zip(*from_2_mm, strict=True)
    return (
        "- At 1 mm, these benches are far from their limit. The ranking costs, and the threshold "
        f"of {least} healthy recordings costs besides, in points: {', '.join(clauses)}.\n"
        f"- From 2 mm on, the ranking costs at most {max(ranks):.1f} points, and the threshold of "
        f"{least} at most {max(thresholds):.1f}.\n"
    )


def main() -> None:
    """Judge every bench, and write the tables into the documents."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    add = parser.add_argument
    every = [*bench_names(), *JUDGED_ONLY_BENCHES]
    add("--benches", nargs="*", choices=every, default=every, help="simulated ones (default: all)")
    add("--folders", nargs="*", type=Path, default=[], help="folders of archives of other benches")
    add("--draws", type=natural, default=5, help="of further healthy ones (default: 5)")
    add("--cache", type=Path, help="folder that keeps what describes the recordings")
    add("--pages", nargs="*", type=Path, default=[], help="documents that get the tables")
    arguments = parser.parse_args()
    config, limit = read_config_file(CONFIG / "config.yaml"), limits(LIMITS.read_text("utf-8"))
    sources = [(folder.name, folder) for folder in arguments.folders]
    sources += [(name, None) for name in arguments.benches]
    losses = {}
    for bench, folder in sources:
        pool = pool_of(bench, folder, config, WEIGHTS, arguments.cache)
        if bench in limit:
            losses[bench] = losses_of(pool, limit[bench], arguments.draws, config)
        print(bench, file=sys.stderr, flush=True)
    blocks = {"losses": losses_table(losses), "answer": answer(losses)}
    for page in arguments.pages:
        text = filled_page(page.read_text("utf-8"), blocks, "judge_thresholds")
        page.write_text(text, encoding="utf-8")
    print("\n".join(blocks.values()))


if __name__ == "__main__":
    main()
