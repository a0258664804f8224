"""How judge_unseen.py judges: by places, on fresh healthy recordings, with failures counted."""

import importlib
from types import SimpleNamespace

import numpy as np
import pytest

from capsule.detectors.base import NO_VERDICT, Verdict
from support.project import ROOT


@pytest.fixture
def module(monkeypatch):
    """Return a function that imports a module of the benchmarks by its name."""
    monkeypatch.syspath_prepend(str(ROOT / "tests" / "benchmarks"))
    return importlib.import_module


class Judging:
    """A detector that remembers what was left out, and whose verdicts are the given sizes."""

    def __init__(self, predicted_mm):
        self.predicted_mm, self.left_out = predicted_mm, []

    def taught(self, archive, left_out=()):
        """Return itself as the detector that the archive has taught."""
        self.left_out.append(sorted(left_out))
        return self

    def verdict(self, name):
        """Return the given verdict."""
        size_mm = self.predicted_mm[name]
        return NO_VERDICT if np.isnan(size_mm) else Verdict(size_mm, 1.0, 0.0)


def judged(module, monkeypatch, predicted_mm, no_verdict=(), **of_archive):
    detector = Judging(predicted_mm)
    judge_unseen = module("judge_unseen")
    monkeypatch.setattr(judge_unseen, "detector_class", lambda name: detector)
    reasons = {name: "no wave" if name in no_verdict else "" for name in predicted_mm}
    archive = SimpleNamespace(no_verdict=reasons, recordings={name: name for name in predicted_mm})
    return judge_unseen.judge(archive, "any", **of_archive), detector


def test_a_recording_without_a_verdict_is_a_failure_with_a_nodule_and_without(module):
    row = module("judge_rates").rates(
        np.array([0.0, 0.0, 1.0, 1.0, 3.0, 3.0]), np.array([0.0, np.nan, 1.0, np.nan, 3.0, np.nan])
    )
    assert row["specificity"] == row["recall at 1 mm"] == row["recall from 2 mm"] == 0.5
    assert row["within 1 mm, from 2 mm"] == 0.5
    assert row["size error, from 2 mm (mm)"] == 0


def test_all_passes_of_a_place_are_left_out_together(module, monkeypatch):
    sizes_mm = {"0mm/r01p1": 0.0, "0mm/r01p2": 0.0, "1mm/r01p1": 1.0}
    sizes_mm |= {"2mm/r01p1": 2.0, "2mm/r01p2": 0.0}
    places = {name: name.rpartition("p")[0] for name in sizes_mm}
    row, detector = judged(module, monkeypatch, sizes_mm, places=places)
    healthy, nodule = ["0mm/r01p1", "0mm/r01p2"], ["2mm/r01p1", "2mm/r01p2"]
    assert detector.left_out == [healthy, ["1mm/r01p1"], nodule]
    assert row["specificity, left out"] == 1
    assert row["recall from 2 mm"] == 0.5


def test_the_specificity_is_that_of_fresh_recordings_which_all_recordings_teach(
    module, monkeypatch
):
    predicted_mm = {"0mm/r01": 0.0, "1mm/r01": 1.0, "2mm/r01": 2.0}
    predicted_mm |= {"fresh/00": 0.0, "fresh/01": 3.0, "fresh/02": 0.0, "fresh/03": np.nan}
    fresh = ["fresh/00", "fresh/01", "fresh/02", "fresh/03"]
    row, detector = judged(module, monkeypatch, predicted_mm, {"fresh/02"}, fresh=fresh)
    assert detector.left_out == [["0mm/r01"], ["1mm/r01"], ["2mm/r01"], []]
    assert row["specificity, left out"] == 1
    assert row["specificity"] == 0.25
    assert row["no verdict"] == 2 / 7


def test_a_kept_description_is_used_unless_it_describes_something_else(
    module, monkeypatch, tmp_path
):
    unseen, judging = module("unseen_archives"), module("judge_unseen")
    weights = judging.WEIGHTS
    config, scorer = judging.read_config_file(ROOT / "config/config.yaml"), None
    scorer = judging.read_scorer(weights)
    source = unseen.Source("losing-logger", runs=1, fresh=2)

    def read(source, number):
        return unseen.described(source, number, config, scorer, weights, tmp_path)

    first, second = read(source, 0), read(source, 1)
    assert len(first.places) == 6
    assert first.fresh == ["fresh/00", "fresh/01"]
    describe = unseen.describe
    monkeypatch.setattr(unseen, "describe", None)
    again = read(source, 1)
    assert unseen._alike(again, second)
    assert not unseen._alike(again, first)
    with pytest.raises(TypeError):
        read(unseen.Source("losing-logger", runs=1, fresh=3), 1)
    # Only the first archive of a bench shows whether other code has filled the folder.
    monkeypatch.setattr(unseen, "describe", describe)
    assert unseen._alike(read(source, 0), first)
    monkeypatch.setattr(unseen, "describe", lambda *of: second)
    with pytest.raises(unseen.CapsuleError, match="other code"):
        read(source, 0)


def test_fresh_recordings_have_no_part_in_any_archive(module):
    unseen = module("unseen_archives")
    source = unseen.Source("uneven-wall", runs=2, fresh=3)
    archives = [source.archive(number) for number in range(2)]
    healthy = [
        values.tobytes()
        for archive in archives
        for values in (archive.readings["0mm/r01"], *archive.fresh.values())
    ]
    assert len(set(healthy)) == len(healthy)


def test_the_fresh_ones_of_a_stored_bench_are_of_its_other_archives(module, tmp_path):
    unseen = module("unseen_archives")
    for number in range(3):
        arrays = {f"{size}mm/r{run}": np.full((4, 9), number) for size in (0, 1) for run in (1, 2)}
        np.savez(tmp_path / f"archive-{number}.npz", **arrays)
    source = unseen.Source("stored", tmp_path, fresh=3)
    fresh = source.archive(1).fresh
    assert [values[0, 0] for values in fresh.values()] == [2, 2, 0]


def row_of(recall, specificity=0.95):
    names = ("specificity", "specificity, left out", "recall at 1 mm", "recall from 2 mm")
    rates = dict(zip(names, (specificity, 0.95, 0.5, recall), strict=True))
    others = ("within 1 mm, from 2 mm", "no verdict", "intervals that hold the size")
    return rates | dict.fromkeys(others, 0.9) | {"seconds": 1.0}


def test_the_range_keeps_the_parts_apart_and_begins_with_the_worst_bench_that_judges_only(module):
    report = module("unseen_report")
    recalls = {"usual": 1.0, "uneven-wall": 0.9, "b": 0.5, "food-residue": 0.7, "sticky-mucus": 0.8}
    judged = {bench: {"taught": [row_of(recall)] * 2} for bench, recall in recalls.items()}
    judged["sticky-mucus"] = {"taught": [row_of(0.8, 0.9)] * 2}
    ranges = report.range_rows(judged)
    assert [(row["part"], row["of the benches the"], row["bench"]) for row in ranges] == [
        ("judged only", "worst", "food-residue"),
        ("judged only", "middle", "food-residue"),
        ("judged only", "best", "sticky-mucus"),
        ("judged only", "least specific", "sticky-mucus"),
        ("chose", "worst", "b"),
        ("chose", "middle", "b"),
        ("chose", "best", "uneven-wall"),
        ("chose", "least specific", "b"),
        ("taught", "only", "usual"),
    ]
    text = report.sentences(judged)
    assert "finds 70.0 to 80.0 % of the nodules from 2 mm on, the least on `food-residue`" in text


def test_every_bench_has_a_part(module):
    unseen, only = module("unseen_archives"), module("judged_only")
    parts = {name: unseen.part_of(name) for name in [*unseen.bench_names(), *only.BENCHES, "b"]}
    assert set(unseen.HAD_A_PART) >= set(unseen.bench_names())
    assert {name for name, part in parts.items() if part == "judged only"} == set(only.BENCHES)
    # A folder of recordings that nobody knows may have had any part.
    assert unseen.part_of("some-folder") == "chose"


def test_only_what_stands_between_the_marks_of_a_page_changes(module):
    page = "a\n\n<!-- judge_unseen: x -->\nold\n\n<!-- end: x -->\n\nb\n"
    filled = module("unseen_report").filled_page(page, {"x": "| \\1 |\n", "y": "none"})
    assert filled == page.replace("old\n", "| \\1 |\n")


def test_the_manual_says_which_bench_had_which_part(module):
    table = module("judge_report").table(module("unseen_report").parts_rows())
    for page in ("docs/detection.md", "workflow/studies/results/detection-benches.md"):
        assert table in (ROOT / page).read_text(encoding="utf-8")


def test_an_archive_is_judged_from_its_simulation_on(module):
    judging, source_of = module("judge_unseen"), module("unseen_archives").Source
    config = judging.read_config_file(ROOT / "config/config.yaml")
    arguments = SimpleNamespace(
        weights=judging.WEIGHTS, cache=None, detectors=["diagonal", "taught"], fit=0, fitted=0
    )
    source = source_of("sticky-mucus", runs=2, passes=2, fresh=3)
    scorer = judging.read_scorer(judging.WEIGHTS)
    rows = judging.judge_archive(source, 0, config, scorer, arguments)
    for row in rows.values():
        assert 0 <= row["specificity"] <= 1
        assert row["recall from 2 mm"] > 0.5
        assert row["no verdict"] == 0
    description = judging.describe(source.archive(0), config, scorer)
    archive = judging.training_archive({}, config, scorer, 0, description)
    # What a detector learns inside a fold leaves places out, too.
    assert archive.places["3mm/r01p1"] == archive.places["3mm/r01p2"] == "3mm/r01"
    assert len(archive.sizes_mm) == 24
