"""Count how often the intervals of the evaluation hold the truth, and print Markdown tables.

    python tests/benchmarks/compare_intervals.py

Rates: each place has a share of its own, from a beta distribution; its passes are drawn from it,
as many over each place, or many over a few places and one over all others.
Areas: normal scores, with a part that all passes over a place share. New specificities: thresholds
at a rank of healthy scores. The worst case stands first.
"""

import argparse
import itertools
from collections.abc import Iterable, Iterator, Sequence

import numpy as np
import pandas as pd
from scipy.special import ndtr, ndtri
from tables import table

from capsule.commands.options import natural
from capsule.detectors.calibrate import rank_threshold
from capsule.evaluation.intervals import Interval, Units, auc_interval, new_specificity, rate_of
from capsule.seeding import generator

LEVEL = 0.95
SHARES = (0.5, 0.7, 0.8, 0.9, 0.95, 0.98)
CORRELATIONS = (0.05, 0.2, 0.5, 0.8)
PLACES = (5, 8, 12, 20, 40)
PASSES = (2, 4, 10)
# Number of places, and of those with several passes, and how many; the others have one.
UNEVEN = ((10, 1, 15), (10, 3, 15), (20, 1, 30), (20, 10, 5), (40, 2, 20))
AREAS = (0.6, 0.76, 0.9, 0.95, 0.98)
# Number of healthy places and of nodules, passes over each, correlation, spread of the nodules.
DESIGNS = (
    (20, 20, 1, 0.0, 1.0),
    (20, 20, 1, 0.0, 3.0),
    (20, 100, 1, 0.0, 1.0),
    (5, 5, 4, 0.5, 1.0),
    (8, 8, 4, 0.5, 3.0),
    (20, 20, 4, 0.2, 3.0),
    (20, 20, 4, 0.9, 3.0),
)
# What the recordings stand for in a rate: ``plainly`` takes each pass for a place of its own;
# ``recordings weighed`` has the same clusters as ``over places``, but each pass weighs as much.
WAYS = {
    "over places": Units.of_places,
    "plainly": lambda places: Units.of_places(np.arange(places.size)),
    "recordings weighed": lambda places: Units(np.ones(places.size), places),
}


def main() -> None:
    """Print the three tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--archives", type=natural, default=1000, help="of each case")
    archives = parser.parse_args().archives
    for title, rows in (
        ("A rate over places", worst_first(rates(archives), list(WAYS))),
        ("An area under the curve", worst_first(areas(archives), ["held"])),
        ("The specificity at new places, central 90 %", specificities(archives)),
    ):
        print(f"{title}:\n\n{table(rows)}")


def held(intervals: Iterable[Interval], truth: float) -> float:
    """Return the share of the intervals that hold the truth; an unknown one does not."""
    return float(np.mean([low <= truth <= high for _, low, high in intervals]))


def worst_first(cases: Iterable[dict], ways: Sequence[str]) -> list[dict]:
    """Return worst and mean share of each way of cases that have all else in common, but the case.

    The worst case is that of the first way.
    """
    table_of, rows = pd.DataFrame(cases), []
    common = [column for column in table_of if column not in (*ways, "worst case")]
    for labels, some in table_of.groupby(common, sort=False):
        row = dict(zip(common, labels, strict=True))
        for way in ways:
            row |= {f"{way}: worst": some[way].min(), f"{way}: mean": some[way].mean()}
        rows.append(row | {"worst case": some["worst case"][some[ways[0]].idxmin()]})
    return sorted(rows, key=lambda row: row[f"{ways[0]}: worst"])


def rates(archives: int) -> Iterator[dict]:
    """Yield how often each interval of a rate holds it, for each number of places."""
    even = [(count, "as many each", [each] * count) for count in PLACES for each in PASSES]
    uneven = [
        (count, f"{some} of {each} passes", [1] * (count - some) + [each] * some)
        for count, some, each in UNEVEN
    ]
    for count, passes, passes_of in even + uneven:
        places = np.repeat(np.arange(count), passes_of)
        design = f"{passes_of[0]} passes" if passes == "as many each" else passes
        for correlation, share in itertools.product(CORRELATIONS, SHARES):
            case = f"{design}, correlation {correlation}, rate {share}"
            hits = [_hits(case, each, places, share, correlation) for each in range(archives)]
            yield {"places": str(count), "passes": passes, "worst case": case} | {
                way: held((rate_of(hit, units(places), LEVEL) for hit in hits), share)
                for way, units in WAYS.items()
            }


def _hits(
    case: str, archive: int, places: np.ndarray, share: float, correlation: float
) -> np.ndarray:
    """Return whether each pass is a hit; `places` holds the place of each."""
    count = int(places.max()) + 1
    numbers = generator(archive, "rate", str(count), case)
    both = (1 - correlation) / correlation
    of_place = numbers.beta(share * both, (1 - share) * both, count)
    return numbers.random(places.size) < of_place[places]


def areas(archives: int) -> Iterator[dict]:
    """Yield how often the interval of an area holds it, for each design of an archive."""
    for (healthy, nodules, passes, correlation, spread), area in itertools.product(DESIGNS, AREAS):
        name = f"{healthy} against {nodules}"
        if passes > 1:
            name += f" places of {passes} passes, correlation {correlation}"
        apart, intervals = ndtri(area) * np.hypot(1, spread), []
        places = np.repeat(np.arange(healthy + nodules), passes)
        kinds = np.split(places, [healthy * passes])
        units = Units.of_places(kinds[0]), Units.of_places(kinds[1])
        for archive in range(archives):
            numbers = generator(archive, "area", name, str(spread), str(area))
            one = _scores(numbers, healthy, passes, correlation)
            other = apart + spread * _scores(numbers, nodules, passes, correlation)
            intervals.append(auc_interval(one, other, units, LEVEL))
        label = {"recordings": name, "nodules' spread": f"{spread:g}"}
        yield label | {"held": held(intervals, area), "worst case": f"an area of {area:g}"}


def _scores(
    numbers: np.random.Generator, places: int, passes: int, correlation: float
) -> np.ndarray:
    of_place = np.repeat(numbers.normal(size=places), passes)
    own = numbers.normal(size=places * passes)
    return np.sqrt(correlation) * of_place + np.sqrt(1 - correlation) * own


def specificities(archives: int) -> list[dict]:
    """Return how often the range holds the specificity of a threshold at a rank of normal scores.

    That law holds at new places of the same mix. Of the variance, 30 % may lie between patients, of
    whom each has as many places; then a new patient has a part of its own.
    """
    rows = []
    same_mix = [(healthy, healthy, 0.0) for healthy in (10, 20, 40, 100)]
    between = [(20, 1, 0.3), (20, 4, 0.3), (40, 4, 0.3), (100, 10, 0.3)]
    for healthy, patients, share in same_mix + between:
        reached = []
        for each in range(10 * archives):
            numbers = generator(each, "new", str(healthy), str(patients), str(share))
            scores = _scores(numbers, patients, healthy // patients, share)
            own = np.sqrt(share) * numbers.normal()
            threshold = rank_threshold(scores, np.arange(healthy), 0.95)
            reached.append(ndtr((threshold - own) / np.sqrt(1 - share)))
        low, high = new_specificity(healthy, 0.95)
        inside = [low <= value <= high for value in reached]
        places = f"of one more patient than {patients}" if share else "of the same mix"
        row = {"healthy places": str(healthy), "new places": places, "range from": low, "to": high}
        rows.append(row | {"held": np.mean(inside), "mean specificity": np.mean(reached)})
    return sorted(rows, key=lambda row: row["held"])


if __name__ == "__main__":
    main()
