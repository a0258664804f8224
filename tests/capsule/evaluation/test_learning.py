"""Learning curves of a simple detector, whose rates can be counted by hand."""

from itertools import combinations
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from capsule.detectors.base import TrainingArchive, Verdict
from capsule.evaluation import learning
from capsule.evaluation.cross_validation import Fold
from support.training import NO_TEMPLATES

SCORES = {
    "0mm/a": 0.1, "0mm/b": 0.2, "0mm/c": 0.4, "0mm/d": 0.6,
    "1mm/a": 0.3, "1mm/b": 0.5, "2mm/a": 0.7, "2mm/b": 0.15,
}  # fmt: skip
SIZES_MM = {name: float(name[0]) for name in SCORES}


class Loudest:
    """A detector: a nodule is what scores above all healthy recordings that taught it."""

    def __init__(self, sizes_mm):
        self.healthy = [name for name, size in sizes_mm.items() if size == 0]
        self.threshold = float("nan")

    def taught(self, archive, left_out):
        """Learn from the others."""
        model = Loudest({})
        taught = [SCORES[name] for name in self.healthy if name not in left_out]
        model.threshold = max(taught, default=float("nan"))
        return model

    def verdict(self, recording):
        """Judge one recording."""
        if np.isnan(self.threshold):
            return Verdict(self.threshold, 0.0, self.threshold)
        score = SCORES[recording.name]
        return Verdict(2.0 * (score > self.threshold), score, self.threshold)


def archive_of(sizes_mm, places=None):
    settings = {"evaluation": {"seed": 1, "confidence": 0.95}}
    recordings = {name: SimpleNamespace(name=name) for name in sizes_mm}
    return TrainingArchive(sizes_mm, recordings, NO_TEMPLATES, {}, settings, places=places or {})


def left_out_alone(sizes_mm):
    """Return the predictions of leave-one-out, as the evaluation does."""
    archive, detector = archive_of(sizes_mm), Loudest(sizes_mm)
    verdicts = [
        detector.taught(archive, [name]).verdict(archive.recordings[name]).predicted_mm
        for name in sizes_mm
    ]
    predictions = pd.DataFrame({"recording": list(sizes_mm), "predicted_mm": verdicts})
    return predictions.assign(detector="loudest", scheme="leave_one_out")


def folds_of(sizes_mm, places=None):
    """Leave out one place at a time."""
    places = places or dict(zip(sizes_mm, sizes_mm, strict=True))
    members = {}
    for name in sizes_mm:
        members.setdefault(places[name], []).append(name)
    return [Fold("leave_one_out", tuple(each), frozenset(each)) for each in members.values()]


def rows_of(sizes_mm, places=None):
    detectors, predictions = {"loudest": Loudest(sizes_mm)}, left_out_alone(sizes_mm)
    archive, folds = archive_of(sizes_mm, places), folds_of(sizes_mm, places)
    return learning.learning_rows(detectors, archive, predictions, folds)


def test_over_all_splits_each_recording_counts_as_often_as_it_is_judged_rightly():
    names = set(SIZES_MM)
    splits = [sorted(names - {*taught}) for taught in combinations(SIZES_MM, 4)]
    right = learning.mean_right(Loudest(SIZES_MM), archive_of(SIZES_MM), splits)
    for name, size_mm in SIZES_MM.items():
        verdicts = []
        for taught in combinations(names - {name}, 4):
            healthy = [SCORES[other] for other in taught if SIZES_MM[other] == 0]
            if healthy:
                verdicts.append((SCORES[name] > max(healthy)) == (size_mm > 0))
        assert right[name] == pytest.approx(np.mean(verdicts))


def test_rates_are_given_of_healthy_recordings_of_each_size_and_of_all_but_the_smallest():
    assert learning.size_ranges([0, 1, 2, 1]) == [(0, 0), (1, 1), (2, 2)]
    assert learning.size_ranges([3, 2.5, 0, 6]) == [(0, 0), (2.5, 2.5), (3, 3), (6, 6), (3, 6)]
    assert learning.size_ranges([]) == []


def test_the_last_point_of_the_curve_is_leave_one_out():
    rows = [row for row in rows_of(SIZES_MM) if row["share"] == learning.ALL_BUT_ONE]
    # Only 0mm/d is louder than the other healthy ones; only 2mm/a is louder than 0mm/d.
    assert [row["rate"] for row in rows] == [0.75, 0.0, 0.5]
    assert [row["judged"] for row in rows] == [4, 2, 2]
    assert [row["taught"] for row in rows] == [7.0] * 3
    assert [row["taught_healthy"] for row in rows] == [3.5] * 3
    assert all(np.isnan(row["gain"]) for row in rows)


def test_every_row_has_the_columns_of_the_table_and_the_gain_ends_at_leave_one_out():
    rows = rows_of(SIZES_MM)
    assert all(row.keys() == set(learning.COLUMNS) for row in rows)
    assert [(row["share"], row["size_from_mm"]) for row in rows] == [
        (share, size) for share in (0.25, 0.5, 0.75, 1.0) for size in (0.0, 1.0, 2.0)
    ]
    last = {row["size_from_mm"]: row["rate"] for row in rows if row["share"] == 1}
    for row in rows:
        if row["share"] < 1:
            assert row["rate"] + row["gain"] == pytest.approx(last[row["size_from_mm"]])
            assert row["gain_low"] < row["gain"] < row["gain_high"]
    assert [row["taught"] for row in rows if row["size_from_mm"] == 0] == [2.0, 4.0, 6.0, 7.0]


def test_no_verdict_is_not_a_right_one_unless_the_split_teaches_too_little_for_any():
    class Silent(Loudest):
        """Like the other, but silent on one recording."""

        def taught(self, archive, left_out):
            """Learn from the others."""
            model = Silent({})
            model.threshold = super().taught(archive, left_out).threshold
            return model

        def verdict(self, recording):
            """Judge one recording."""
            if recording.name == "2mm/a":
                return Verdict(float("nan"), 0.0, self.threshold)
            return super().verdict(recording)

    splits = [["0mm/c", "2mm/a"]]
    # Without a healthy recording there is no threshold, and no verdict at all.
    splits += [["0mm/a", "0mm/b", "0mm/c", "0mm/d", "1mm/b"]]
    right = learning.mean_right(Silent(SIZES_MM), archive_of(SIZES_MM), splits)
    assert (right["0mm/c"], right["2mm/a"]) == (1.0, 0.0)
    assert np.isnan(right["1mm/b"]) and np.isnan(right["0mm/a"])


def test_the_intervals_are_over_places_and_no_place_is_on_both_sides():
    places = {name: name[:3] + str("ab".count(name[-1])) for name in SIZES_MM}
    rows = rows_of(SIZES_MM, places)
    assert all(row["clusters"] <= 2 for row in rows if row["size_from_mm"] == row["size_to_mm"])
    assert all(np.isnan(row["rate_low"]) for row in rows if row["judged"] > row["clusters"])
    last = [row for row in rows if row["share"] == learning.ALL_BUT_ONE]
    # Two healthy places of two recordings: two of four teach.
    assert [row["taught_healthy"] for row in last] == [3.0] * 3


def test_held_out_recordings_neither_teach_nor_are_judged():
    # Were "0mm/d" to teach, nothing but 2mm/a would be louder.
    folds = folds_of({name: size for name, size in SIZES_MM.items() if name != "0mm/d"})
    folds.append(Fold("held_out", ("0mm/d",), frozenset({"0mm/d"})))
    detectors, archive = {"loudest": Loudest(SIZES_MM)}, archive_of(SIZES_MM)
    rows = learning.learning_rows(detectors, archive, left_out_alone(SIZES_MM), folds)
    last = [row for row in rows if row["share"] == learning.ALL_BUT_ONE]
    assert [row["judged"] for row in last] == [3, 2, 2]
    assert [row["taught"] for row in last] == [6.0] * 3
    three_quarters = {row["size_from_mm"]: row["rate"] for row in rows if row["share"] == 0.75}
    assert three_quarters[1.0] > 0


@pytest.mark.parametrize("recordings", [480, 1200])
def test_in_a_large_archive_not_every_recording_is_judged_at_every_share(recordings, monkeypatch):
    sizes_mm = {f"{number % 3}mm/{number}": float(number % 3) for number in range(recordings)}
    scores = {name: place * 7 % 31 / 31 for place, name in enumerate(sizes_mm)}
    monkeypatch.setattr(f"{__name__}.SCORES", scores)
    rows = [row for row in rows_of(sizes_mm) if row["size_from_mm"] == row["size_to_mm"]]
    judged = {share: 0 for share in (0.25, 0.5, 0.75, 1.0)}
    for row in rows:
        judged[row["share"]] += row["judged"]
        assert 0 <= row["rate_low"] <= row["rate"] <= row["rate_high"] <= 1
    assert judged[0.75] < recordings == judged[1.0]


@pytest.mark.parametrize(
    "names",
    [[], ["0mm/a"], ["2mm/a"], ["0mm/a", "1mm/a"], ["0mm/a", "0mm/b"], ["1mm/a", "2mm/a"]],
    ids=" ".join,
)
def test_an_archive_with_hardly_a_recording_has_rows_without_error(names):
    sizes_mm = {name: SIZES_MM[name] for name in names}
    rows = rows_of(sizes_mm)
    assert len(rows) == 4 * len(set(sizes_mm.values()))
    assert all(np.isnan(row["rate"]) == (row["judged"] == 0) for row in rows)


def test_without_leave_one_out_the_curve_has_no_last_point_and_no_gain():
    detectors = {"loudest": Loudest(SIZES_MM)}
    predictions = left_out_alone(SIZES_MM).assign(scheme="resubstitution")
    archive, folds = archive_of(SIZES_MM), folds_of(SIZES_MM)
    rows = learning.learning_rows(detectors, archive, predictions, folds)
    assert {row["share"] for row in rows} == {0.25, 0.5, 0.75}
    assert all(np.isnan(row["gain"]) for row in rows)


def test_what_tells_most_is_no_nodule_the_smallest_size_and_all_larger_ones():
    assert learning.main_ranges([0, 1, 2, 3]) == [(0, 0), (1, 1), (2, 3)]
    assert learning.main_ranges([1, 2]) == [(1, 1), (2, 2)]
    assert learning.main_ranges([0]) == [(0, 0)]
    assert learning.main_ranges([]) == []
