"""What is computed of a recording when a detector asks for it, and comes back from its file."""

import numpy as np
import pytest

from capsule.detectors import described as stored
from capsule.detectors.described import read_scorer
from capsule.detectors.described_recording import DescribedRecording, described
from capsule.detectors.files import read_template_set, read_templates
from capsule.detectors.network import Features
from capsule.detectors.search import UNKNOWN, Passage, passage_of, series_of
from capsule.detectors.wave import wave_of
from capsule.detectors.wave_traits import UNKNOWN_TRAITS, WaveTraits, wave_traits
from capsule.engine.configuration import read_config_file
from capsule.engine.project import CONFIG, WEIGHTS
from capsule.method.preprocessing import preprocess
from capsule.phantom.files import DEFAULT_TABLE, read_phantom
from capsule.phantom.simulation import simulate_run

SETTINGS = read_config_file(CONFIG / "config.yaml")
WINDOW = SETTINGS["preprocessing"]["window"]


@pytest.fixture(scope="module")
def run():
    phantom = read_phantom(DEFAULT_TABLE, [])
    return simulate_run(phantom, 3.0, 1, "3mm/r01").counts.astype(float)


def test_each_part_is_what_the_detectors_functions_give(run):
    recording, bench = DescribedRecording(run, SETTINGS), SETTINGS["diagonal"]
    wave = wave_of(run, 10.0, bench)
    np.testing.assert_array_equal(recording.matrix, preprocess(run, **SETTINGS["preprocessing"]))
    assert recording.no_verdict == ""
    assert recording.passage == passage_of(wave, bench)
    assert recording.traits == wave_traits(wave, 10.0)
    features = read_scorer(WEIGHTS).features(series_of(wave))
    np.testing.assert_equal(vars(recording.features), vars(features))
    # The same readings are described once for the same settings.
    (first,), (again,) = (described([run.copy()], SETTINGS) for _ in range(2))
    other = SETTINGS | {"diagonal": bench | {"dwell": 9.0}}
    assert first is again and described([run], other)[0] is not first
    assert described([run + 1.0], SETTINGS)[0].name != first.name


def test_it_says_why_there_is_no_verdict(run):
    for values, reason in (
        (run[:, : WINDOW - 1], f"{WINDOW - 1} samples are fewer than the window of {WINDOW}"),
        (run * [[1], [0], [1], [1]], "sensor_2 is constant or missing"),
        (run * [[1], [np.nan], [1], [1]], "sensor_2 is constant or missing"),
        (np.random.default_rng(1).normal(500, 5, run.shape), "no wave on sensor_1"),
    ):
        assert DescribedRecording(values, SETTINGS).no_verdict.startswith(reason)


# Files.


def test_templates_are_read_by_size_in_their_order(tmp_path):
    path = tmp_path / "templates.npz"
    shapes = {"0mm": np.zeros((4, 9)), "2.5mm": np.ones((4, 9)), "10mm": np.eye(4, 9)}
    np.savez(path, **shapes)
    whole = read_template_set(path, 3)
    assert (whole.sizes_mm, whole.first_peak) == ((0.0, 2.5, 10.0), 3)
    np.testing.assert_equal(list(whole.matrices), list(shapes.values()))
    read = dict(zip(whole.sizes_mm, shapes.values(), strict=True))
    np.testing.assert_equal(read_templates(path), read)


THREE, FIVE = np.ones(3, np.float32), np.arange(5, dtype=np.float32)
FEATURES = {f"3mm/{number}": Features(number, number * THREE, FIVE) for number in (1.0, np.nan)}
PLACE = Passage(0.1 + 0.2, 1, 2, 3, 4.5, 128, 130, 0.1, 1 / 3, 0.1)
PLACES = {"0mm/a": (PLACE, WaveTraits(3.2, 0.25, 1 / 3, 0.01, 0.9, 0.1))}
PLACES["0mm/b"] = UNKNOWN, UNKNOWN_TRAITS


# A batch without a usable recording has none.
@pytest.mark.parametrize(("what", "made"), [("features", FEATURES), ("best_places", PLACES)])
def test_what_describes_recordings_comes_back_in_full_precision(tmp_path, what, made):
    for written in (made, {}):
        getattr(stored, f"write_{what}")(tmp_path / "batch", written)
        found = getattr(stored, f"read_{what}")(tmp_path / "batch")
        assert list(found) == list(written)
        for there, each in zip(found.values(), written.values(), strict=True):
            pairs = zip(there, each, strict=True) if what == "best_places" else [(there, each)]
            for part, wanted in pairs:
                np.testing.assert_equal(vars(part), vars(wanted))
