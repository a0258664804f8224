"""The shipped archive tells foreign readings from recordings of its own bench."""

from dataclasses import astuple

import numpy as np
import pytest
from scipy.signal import lfilter

import capsule
from capsule.detectors.described_recording import DescribedRecording
from capsule.detectors.familiar import learn_familiar
from capsule.recordings.held_out import teaching
from capsule.recordings.names import size_mm
from capsule.seeding import generator
from support.project import ROOT

pytestmark = [pytest.mark.slow, pytest.mark.takes(8)]


def answers_of(teach, judged):
    rows = np.array([astuple(each) for each in teach])
    answers = learn_familiar(rows, np.arange(len(rows))).judge_all(list(judged))
    return [each.familiar for each in answers]


@pytest.fixture(scope="module")
def shipped():
    """Return the traits of all recordings, the names of those that teach, and the settings."""
    archive = capsule.load(ROOT / "raw")
    index, settings = archive.index(archive.labelled), archive.settings
    traits = {name: DescribedRecording(archive.readings[name], settings).traits for name in index}
    return traits, teaching(index, settings["evaluation"]["held_out"]).keys(), settings


def test_held_out_set_ups_and_larger_nodules_than_those_that_teach_are_familiar(shipped):
    traits, teach, _ = shipped
    largest = {name for name in traits if size_mm(name) == 5}
    small = {name for name in teach if size_mm(name) < 4}
    for taught, judged, count in ((teach, traits.keys() - teach, 160), (small, largest, 40)):
        answers = answers_of([traits[name] for name in taught], [traits[name] for name in judged])
        assert len(answers) == count
        assert answers.count(False) <= 0.05 * count


def shared_noise(numbers):
    """Return slow noise that neighbouring sensors share in part."""
    rows = lfilter([1], [1, -numbers.uniform(0.5, 0.99)], numbers.normal(0, 8, (4, 800)), axis=1)
    shared = numbers.uniform(0.2, 0.8) ** np.abs(np.subtract.outer(np.arange(4), np.arange(4)))
    return 500 + (shared @ rows)[:, 200:]


def travelling_noise(numbers):
    """Return slow noise that reaches one sensor after the other."""
    recursion, delay = [1, -numbers.uniform(0.5, 0.99)], int(numbers.integers(1, 8))
    row = lfilter([1], recursion, numbers.normal(0, 8, 900))[200:]
    return 500 + np.stack([row[sensor * delay :][:600] for sensor in range(4)])


def ridges(numbers):
    """Return four neighbouring channels of a finger on a board of ridges, at some speed."""
    path = numbers.choice(sorted((ROOT / "tests/data/fabricslide").glob("*.csv")))
    channels = np.loadtxt(path, delimiter=",", skiprows=1)[:, 3:].T
    first, speed = int(numbers.integers(13)), float(numbers.choice([1.0, 1.2, 1.5]))
    at, every = np.arange(0, channels.shape[1] - 1, speed), np.arange(channels.shape[1])
    return np.stack([np.interp(at, every, row) for row in channels[first : first + 4]])


@pytest.mark.parametrize(
    ("foreign", "runs"), [(shared_noise, 400), (travelling_noise, 60), (ridges, 120)]
)
def test_foreign_readings_that_would_get_a_verdict_are_unlike(shipped, foreign, runs):
    traits, teach, settings = shipped
    made = [foreign(generator(1, "foreign", foreign.__name__, str(run))) for run in range(runs)]
    recordings = [DescribedRecording(values, settings) for values in made]
    judged = [each.traits for each in recordings if not each.no_verdict]
    answers = answers_of([traits[name] for name in teach], judged)
    assert len(answers) >= 5
    assert len(answers) - answers.count(False) <= 0.05 * len(answers)
