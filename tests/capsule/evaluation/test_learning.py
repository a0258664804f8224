"""Learning curves of a simple detector, whose rates can be counted by hand."""

from itertools import combinations

import numpy as np
import pytest

from capsule.detectors.training import TrainingArchive
from capsule.detectors.verdicts import Verdict
from capsule.evaluation import learning
from capsule.evaluation.agreement import paired_difference
from capsule.evaluation.learning_splits import Split
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

    def without(self, left_out):
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


def archive_of(sizes_mm):
    settings = {"evaluation": {"seed": 1, "confidence": 0.95, "most_folds": 1000}}
    return TrainingArchive(sizes_mm, NO_TEMPLATES, {}, {}, {}.__getitem__, settings)


def left_out_alone(sizes_mm):
    """Return the predictions of leave-one-out, as the evaluation does."""
    archive, detector = archive_of(sizes_mm), Loudest(sizes_mm)
    return [
        {
            "detector": "loudest",
            "scheme": "leave_one_out",
            "recording": name,
            "predicted_mm": detector.without([name]).verdict(archive.recording(name)).predicted_mm,
        }
        for name in sizes_mm
    ]


def rows_of(sizes_mm):
    detectors = {"loudest": Loudest(sizes_mm)}
    return learning.learning_rows(detectors, archive_of(sizes_mm), left_out_alone(sizes_mm))


def test_over_all_splits_each_recording_counts_as_often_as_it_is_judged_rightly():
    names = set(SIZES_MM)
    splits = [Split(0.5, taught, tuple(names - {*taught})) for taught in combinations(SIZES_MM, 4)]
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


def test_the_gain_of_whole_verdicts_is_that_of_paired_shares():
    before, after = np.array([1, 0, 0, 1, 0, 0, 1.0]), np.array([1, 1, 1, 0, 1, 0, 1.0])
    expected = paired_difference(before == 1, after == 1, 0.95)
    ends = ("difference", "difference_low", "difference_high")
    assert learning.mean_gain(before, after, 0.95) == pytest.approx([expected[e] for e in ends])


def test_a_recording_that_was_not_judged_both_times_has_no_gain():
    before, after = np.array([0.5, np.nan, 0.25]), np.array([1.0, 1.0, np.nan])
    assert learning.mean_gain(before, after, 0.95)[0] == 0.5
    assert np.isnan(learning.mean_gain(before[1:], after[1:], 0.95)).all()


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
    rows = learning.learning_rows(detectors, archive_of(SIZES_MM), [])
    assert {row["share"] for row in rows} == {0.25, 0.5, 0.75}
    assert all(np.isnan(row["gain"]) for row in rows)


def test_what_tells_most_is_no_nodule_the_smallest_size_and_all_larger_ones():
    assert learning.main_ranges([0, 1, 2, 3]) == [(0, 0), (1, 1), (2, 3)]
    assert learning.main_ranges([1, 2]) == [(1, 1), (2, 2)]
    assert learning.main_ranges([0]) == [(0, 0)]
    assert learning.main_ranges([]) == []
