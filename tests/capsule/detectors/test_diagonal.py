"""The diagonal detector: recordings that are left out teach nothing."""

from dataclasses import replace

import numpy as np
import pytest

from capsule.detectors.calibrate import fit_sizes
from capsule.detectors.diagonal import Diagonal, size_features
from capsule.detectors.search import UNKNOWN, Passage
from capsule.seeding import generator
from support.training import archive_of_passages, recordings_of, verdict_values

LEARNING = {"specificity": 0.9, "prevalence": 0.5, "size_ridge": 1.0}


def passage(score, size=0.0):
    return Passage(score, size, size, size, 10.0, 200.0, 130.0, *[np.exp(size)] * 3)


def archive_of(count, name, slope):
    """Draw an archive whose evidence and level grow with the size."""
    numbers = generator(1, name)
    sizes = {f"{place % 4}mm/r{place}": float(place % 4) for place in range(count)}
    passages = {
        name: passage(slope * size + numbers.normal(), size + numbers.normal() / 2)
        for name, size in sizes.items()
    }
    return archive_of_passages(passages, sizes, **LEARNING)


def judge(archive, name, left_out):
    """Return the verdict on a recording; only the others teach."""
    return Diagonal.taught(archive, left_out).verdict(archive.recordings[name])


def test_a_recording_does_not_teach_its_own_verdict():
    sizes = {f"0mm/r{run}": 0.0 for run in range(10)} | {"1mm/r0": 1.0, "2mm/r0": 2.0}
    passages = {name: passage(0.1 * place, sizes[name]) for place, name in enumerate(sizes)}
    passages["0mm/r9"] = passage(9.0)
    archive = archive_of_passages(passages, sizes, **LEARNING)
    alone = judge(archive, "0mm/r9", ["0mm/r9"])
    assert alone.threshold == pytest.approx(0.8)
    assert alone.predicted_mm > 0
    assert judge(archive, "0mm/r9", []).predicted_mm == 0
    without_a_size = judge(archive, "2mm/r0", ["2mm/r0", "0mm/r9"])
    assert without_a_size.estimate_mm == 1.0
    # No recording is left to predict the one other nodule.
    assert (without_a_size.estimate_low_mm, without_a_size.estimate_high_mm) == (1.0, np.inf)


def test_an_unknown_passage_has_no_verdict_and_teaches_nothing():
    sizes = {"0mm/a": 0.0, "0mm/b": 0.0, "0mm/c": 0.0, "2mm/a": 2.0}
    passages = {"0mm/a": passage(0.1), "0mm/b": passage(0.2), "0mm/c": UNKNOWN}
    passages["2mm/a"] = passage(1.0, 2.0)
    archive = archive_of_passages(passages, sizes, **LEARNING)
    assert np.isnan(judge(archive, "0mm/c", ["0mm/c"]).predicted_mm)
    assert judge(archive, "2mm/a", ["2mm/a"]).threshold == 0.2


def test_a_fold_teaches_what_an_archive_of_its_recordings_alone_does():
    numbers = generator(1, "diagonal archive")
    sizes = {f"{place % 4}mm/r{place}": float(place % 4) for place in range(120)}
    passages = {
        name: passage(size / 2 + numbers.normal(), size + numbers.normal() / 4)
        for name, size in sizes.items()
    }
    passages["1mm/r5"] = UNKNOWN
    archive = archive_of_passages(passages, sizes, **LEARNING)
    for left_out in ([], ["0mm/r0"], ["3mm/r7"], ["1mm/r5"], [n for n in sizes if n < "1mm/r4"]):
        taught = {name: size for name, size in sizes.items() if name not in left_out}
        alone = Diagonal.taught(archive_of_passages(passages, taught, **LEARNING))
        model = Diagonal.taught(archive, left_out)
        for name in passages:
            verdict, expected = (
                verdict_values(each.verdict(archive.recordings[name])) for each in (model, alone)
            )
            np.testing.assert_allclose(verdict, expected)


def test_the_interval_comes_from_the_detected_nodules_of_the_fold_each_left_out():
    archive, left_out = archive_of(100, "interval", 1.0), "3mm/r7"
    verdict = judge(archive, left_out, [left_out])
    taught = [name for name in archive.sizes_mm if name != left_out and archive.sizes_mm[name]]
    features = np.array([size_features(archive.recordings[name].passage) for name in taught])
    sizes_mm = np.array([archive.sizes_mm[name] for name in taught])
    errors = []
    for place, name in enumerate(taught):
        if archive.recordings[name].passage.evidence > verdict.threshold:
            others = np.arange(sizes_mm.size) != place
            model = fit_sizes(
                features[others],
                sizes_mm[others],
                np.flatnonzero(others),
                others[others],
                ridge=LEARNING["size_ridge"],
                confidence=0.9,
            )
            errors.append(float(model.regression.of(features[place])) - sizes_mm[place])
    assert 20 < len(errors) < sizes_mm.size
    half_width = np.sort(np.abs(errors))[int(np.ceil(0.9 * (len(errors) + 1))) - 1]
    # The model also scales its features without the one recording; the closed form does not.
    assert verdict.estimate_low_mm == pytest.approx(verdict.estimate_mm - half_width, abs=0.01)
    high = verdict.estimate_mm + half_width
    assert verdict.estimate_high_mm == pytest.approx(high if high < 3 else np.inf, abs=0.01)


@pytest.mark.slow
def test_nine_intervals_of_ten_hold_the_size_of_a_detected_nodule():
    held = []
    for number in range(12):
        archive = archive_of(160, f"coverage {number}", 0.8)
        for name, size in archive.sizes_mm.items():
            verdict = Diagonal.taught(archive, [name]).verdict(archive.recordings[name])
            if size and verdict.predicted_mm:
                held.append(verdict.estimate_low_mm <= size <= verdict.estimate_high_mm)
    # About 900 sizes: the standard error is 0.01.
    assert np.mean(held) == pytest.approx(0.9, abs=0.03)


def test_no_verdict_moves_when_another_pass_of_its_place_is_replaced():
    archive = archive_of(60, "places", 1.0)
    places = {name: f"{name[:3]}/{number // 8}" for number, name in enumerate(archive.sizes_mm)}
    for name, sibling in (("0mm/r0", "0mm/r4"), ("3mm/r7", "3mm/r3")):
        assert places[name] == places[sibling]
        left_out = [other for other, place in places.items() if place == places[name]]
        changed = {**archive.recordings, **recordings_of({sibling: passage(9.0, 9.0)})}
        verdicts = [
            Diagonal.taught(replace(archive, recordings=each, places=places), left_out).verdict(
                archive.recordings[name]
            )
            for each in (archive.recordings, changed)
        ]
        np.testing.assert_equal(*map(verdict_values, verdicts))


def test_passes_over_one_place_raise_the_threshold_no_more_than_one_pass():
    sizes = {f"0mm/r{run}": 0.0 for run in range(19)} | {"2mm/r0": 2.0}
    passages = {name: passage(0.1 * number, sizes[name]) for number, name in enumerate(sizes)}
    few = archive_of_passages(passages, sizes, **LEARNING)
    again = {f"0mm/again{run}": 0.0 for run in range(80)}
    many = archive_of_passages(
        passages | dict.fromkeys(again, passage(1.8)), sizes | again, **LEARNING
    )
    one_place = replace(many, places=dict.fromkeys(again, "0mm/r18"))
    expected = Diagonal.taught(few).threshold
    assert Diagonal.taught(one_place).threshold == expected
    assert Diagonal.taught(many).threshold > expected
