"""Near-copies of a run are found; different runs over one place are not near-copies."""

import time

import numpy as np
import pytest

from capsule.near_copies import fingerprint, near_copies, nearly_equal
from capsule.recording import read_recording
from support.project import ROOT
from support.synthetic import make_recording

pytestmark = pytest.mark.takes(0.1)


def readings(name, samples=400):
    return make_recording(3.0, name, samples=samples).values


def found_in(archive):
    marks = {name: fingerprint(values) for name, values in archive.items()}
    return near_copies(marks, archive.__getitem__)


def one_sample_changed(values):
    values[1, 100] = 0.0
    return values


def a_piece_missing(values):
    values[:, 100:115] = np.nan
    return values


def with_a_fault(values):
    values[:, 200:260] = 512.0 + np.arange(60) % 3
    return values


ALIKE = {
    "one sample changed": one_sample_changed,
    "the last row dropped": lambda values: values[:, :-1],
    "the first rows dropped": lambda values: values[:, 3:],
    "the first 60 %": lambda values: values[:, : int(0.6 * values.shape[1])],
    "columns permuted": lambda values: values[[2, 0, 3, 1]],
    "counts in volts": lambda values: np.round(values * 5.0 / 1023, 3),
    "ohms of the divider": lambda values: 12000.0 * (1024.0 / values - 1.0),
    "a piece missing": a_piece_missing,
    "a minute's fault": with_a_fault,
    "all at once": lambda values: np.round(
        one_sample_changed(values)[[1, 0, 3, 2], 2:-5] / 204.6, 3
    ),
}


@pytest.mark.parametrize("change", list(ALIKE.values()), ids=list(ALIKE))
def test_a_run_that_is_the_same_but_for_little_is_found(change):
    archive = {f"3mm/r{run:02d}": readings(f"3mm/r{run:02d}") for run in range(12)}
    archive["4mm/r03"] = change(readings("3mm/r03"))
    assert found_in(archive) == {
        "3mm/r03": ["4mm/r03"],
        "4mm/r03": ["3mm/r03"],
    }


def standardized(values):
    centred = values - np.nanmedian(values, axis=1, keepdims=True)
    spread = np.nanmedian(np.abs(centred), axis=1, keepdims=True)
    return np.clip(centred / spread, -4.0, 4.0)


def median_correlation(one, other):
    known = ~(np.isnan(one) | np.isnan(other))
    sections = [np.array_split(row[known], 8) for row in (one, other)]
    return np.median([abs(np.corrcoef(a, b)[0, 1]) for a, b in zip(*sections, strict=True)])


@pytest.mark.parametrize("noise", [0.0, 0.1, 0.15, 0.3])
@pytest.mark.parametrize("cut", [0, 40])
def test_two_runs_are_the_same_if_each_sensor_correlates_with_one_of_the_other(noise, cut):
    numbers = np.random.default_rng(1)
    one = numbers.normal(size=(4, 400))
    other = (one + noise * numbers.normal(size=one.shape))[[2, 0, 3, 1], cut:]
    other[:, 50:60] = np.nan
    first, second = standardized(one)[:, cut:], standardized(other)
    best = [max(median_correlation(row, each) for each in second) for row in first]
    assert nearly_equal(one, other) == (min(best) >= 0.99) == (noise < 0.12)


def test_copies_of_copies_belong_together():
    archive = {f"3mm/r{run:02d}": readings(f"3mm/r{run:02d}") for run in range(5)}
    for cut in range(1, 31):
        archive[f"5mm/cut{cut:02d}"] = readings("3mm/r02")[:, cut:]
    found = found_in(archive)
    assert set(found) == {"3mm/r02", *(name for name in archive if name.startswith("5mm"))}
    assert all(len(others) == 30 for others in found.values())


def test_different_runs_are_no_copies():
    archive = {}
    for path in sorted((ROOT / "raw").glob("[05]mm/*.csv")):
        with path.open("rb") as stream:
            archive[path.stem + path.parent.name] = read_recording(stream, 4).values
    assert found_in(archive) == {}
    names = list(archive)
    assert not any(nearly_equal(archive[names[0]], archive[name]) for name in names[1:])


def test_runs_without_a_change_and_no_runs_at_all_are_no_copies():
    flat = {name: np.tile(np.array([1.0, 2.0]), (4, 10)) for name in "ab"}
    assert found_in(flat) == {}
    assert found_in({}) == {}


def test_thousands_are_searched_in_seconds():
    numbers = np.random.default_rng(1)
    archive = {str(run): numbers.normal(size=(4, 500)).round(1) for run in range(2000)}
    archive["copy"] = archive["77"][:, 1:]
    started = time.process_time()
    assert found_in(archive) == {"77": ["copy"], "copy": ["77"]}
    assert time.process_time() - started < 20
