"""Count how often the intervals of the evaluation hold the truth, and print Markdown tables.

    python tests/benchmarks/compare_intervals.py

Rates: each place has a share of its own, from a beta distribution; its passes are drawn from it,
as many over each place, or many over a few places and one over all others.
Areas: normal scores, with a part that all passes over a place share. New specificities: thresholds
at a rank of healthy scores. The worst case stands first.
"""

import argparse
import sys
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

import numpy as np
from scipy.special import ndtr, ndtri

FOLDERS = [Path(__file__).parents[2] / "workflow" / each for each in ("scripts", "studies")]
sys.path[:0] = map(str, FOLDERS)

from judge_rates import table

from capsule.arguments import natural
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


def main() -> None:
    """Print the five tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--archives", type=natural, default=1000, help="of each case")
    archives = parser.parse_args().archives
    for title, rows in (
        ("A rate over places", rates(archives)),
        ("A rate over places of which some have many passes", uneven_rates(archives)),
        ("An area under the curve", areas(archives)),
        ("The specificity at new places, central 90 %", specificities(archives)),
        ("The same range, and a new patient", of_patients(archives)),
    ):
        print(f"{title}:\n\n{table(rows)}")


def held(intervals: Iterable[Interval], truth: float) -> float:
    """Return the share of the intervals that hold the truth; an unknown one does not."""
    return float(np.mean([low <= truth <= high for _, low, high in intervals]))


def rates(archives: int) -> list[dict[str, object]]:
    """Return how often the interval of a rate holds it, for each number of places.

    ``plainly`` is the Wilson interval that takes each pass for a place of its own.
    """
    rows = []
    for places in PLACES:
        cases: dict[str, list[float]] = {"over places": [], "plainly": []}
        names = []
        for passes in PASSES:
            numbers = np.repeat(np.arange(places), passes)
            for correlation in CORRELATIONS:
                for share in SHARES:
                    names.append(f"{passes} passes, correlation {correlation}, rate {share}")
                    drawn = [
                        _hits(names[-1], each, numbers, share, correlation)
                        for each in range(archives)
                    ]
                    for name, of in (("over places", Units.of_places(numbers)), ("plainly", None)):
                        intervals = (rate_of(hits, of, LEVEL) for hits in drawn)
                        cases[name].append(held(intervals, share))
        row: dict[str, object] = {"places": str(places)}
        for name, coverage in cases.items():
            row[f"{name}: worst"], row[f"{name}: mean"] = min(coverage), float(np.mean(coverage))
        rows.append(row | {"worst case": names[int(np.argmin(cases["over places"]))]})
    return _worst_first(rows, "over places: worst")


def uneven_rates(archives: int) -> list[dict[str, object]]:
    """Return how often the interval of a rate holds it, if some places have many passes.

    ``recordings weighed`` is the interval over the same clusters in which each pass weighs as much.
    """
    rows = []
    for places, several, passes in UNEVEN:
        numbers = np.repeat(np.arange(places), [1] * (places - several) + [passes] * several)
        ways = {
            "places weighed": Units.of_places(numbers),
            "recordings weighed": Units(np.ones(numbers.size), numbers),
        }
        cases: dict[str, list[float]] = {way: [] for way in ways}
        names = []
        for correlation in CORRELATIONS:
            for share in SHARES:
                names.append(f"correlation {correlation}, rate {share}")
                case = f"{several} of {passes} passes, {names[-1]}"
                drawn = [_hits(case, each, numbers, share, correlation) for each in range(archives)]
                for way, units in ways.items():
                    cases[way].append(held((rate_of(hits, units, LEVEL) for hits in drawn), share))
        row: dict[str, object] = {
            "places": str(places),
            "of these": f"{several} of {passes} passes",
        }
        for way, coverage in cases.items():
            row[f"{way}: worst"], row[f"{way}: mean"] = min(coverage), float(np.mean(coverage))
        rows.append(row | {"worst case": names[int(np.argmin(cases["places weighed"]))]})
    return _worst_first(rows, "places weighed: worst")


def _hits(
    case: str, archive: int, places: np.ndarray, share: float, correlation: float
) -> np.ndarray:
    """Return whether each pass is a hit; `places` holds the place of each."""
    count = int(places.max()) + 1
    numbers = generator(archive, "rate", str(count), case)
    both = (1 - correlation) / correlation
    of_place = numbers.beta(share * both, (1 - share) * both, count)
    return numbers.random(places.size) < of_place[places]


def areas(archives: int) -> list[dict[str, object]]:
    """Return how often the interval of an area holds it, for each design of an archive."""
    rows = []
    for healthy, nodules, passes, correlation, spread in DESIGNS:
        name = f"{healthy} against {nodules}"
        if passes > 1:
            name += f" places of {passes} passes, correlation {correlation}"
        coverage = []
        for area in AREAS:
            apart = ndtri(area) * np.hypot(1, spread)
            intervals = []
            for archive in range(archives):
                numbers = generator(archive, "area", name, str(spread), str(area))
                one = _scores(numbers, healthy, passes, correlation)
                other = apart + spread * _scores(numbers, nodules, passes, correlation)
                places = np.repeat(np.arange(healthy + nodules), passes)
                units = map(Units.of_places, np.split(places, [healthy * passes]))
                intervals.append(auc_interval(one, other, LEVEL, *units))
            coverage.append(held(intervals, area))
        row: dict[str, object] = {"recordings": name, "nodules' spread": f"{spread:g}"}
        row |= {"worst": min(coverage), "at an area of": f"{AREAS[int(np.argmin(coverage))]:g}"}
        rows.append(row | {"mean": float(np.mean(coverage))})
    return _worst_first(rows, "worst")


def _scores(
    numbers: np.random.Generator, places: int, passes: int, correlation: float
) -> np.ndarray:
    of_place = np.repeat(numbers.normal(size=places), passes)
    own = numbers.normal(size=places * passes)
    return np.sqrt(correlation) * of_place + np.sqrt(1 - correlation) * own


def specificities(archives: int) -> list[dict[str, object]]:
    """Return how often the range holds the specificity of a threshold at a rank."""
    kinds: dict[str, tuple[Callable[..., np.ndarray], Callable[[float], float]]] = {
        "normal scores": (lambda numbers, n: numbers.normal(size=n), lambda x: float(ndtr(x))),
        "scores with a heavy tail": (
            lambda numbers, n: numbers.standard_cauchy(n),
            lambda x: float(0.5 + np.arctan(x) / np.pi),
        ),
    }
    rows = []
    for healthy in (10, 20, 40, 100):
        low, high = new_specificity(healthy, 0.95)
        for name, (draw, share_below) in kinds.items():
            reached = []
            for archive in range(10 * archives):
                scores = np.sort(draw(generator(archive, "new", name, str(healthy)), healthy))
                rank = min(int(np.ceil((healthy + 1) * 0.95 - 1e-9)), healthy)
                reached.append(share_below(scores[rank - 1]))
            inside = float(np.mean([low <= value <= high for value in reached]))
            rows.append(
                {"healthy places": str(healthy), "scores": name, "range from": low, "to": high}
                | {"held": inside, "mean specificity": float(np.mean(reached))}
            )
    return _worst_first(rows, "held")


def of_patients(archives: int) -> list[dict[str, object]]:
    """Return how often that range holds the specificity of a new patient.

    30 % of the variance of the scores lie between patients, of whom each has as many places.
    """
    rows = []
    for healthy, patients in ((20, 1), (20, 4), (40, 4), (100, 10)):
        low, high = new_specificity(healthy, 0.95)
        rank = min(int(np.ceil((healthy + 1) * 0.95 - 1e-9)), healthy)
        inside = []
        for archive in range(10 * archives):
            numbers = generator(archive, "patients", str(healthy), str(patients))
            scores = _scores(numbers, patients, healthy // patients, 0.3)
            own = (np.sort(scores)[rank - 1] - np.sqrt(0.3) * numbers.normal()) / np.sqrt(0.7)
            inside.append(low <= float(ndtr(own)) <= high)
        row = {"healthy places": str(healthy), "patients": str(patients)}
        rows.append(row | {"held": float(np.mean(inside))})
    return _worst_first(rows, "held")


def _worst_first(rows: Sequence[dict[str, object]], column: str) -> list[dict[str, object]]:
    return sorted(rows, key=lambda row: float(str(row[column])))


if __name__ == "__main__":
    main()
