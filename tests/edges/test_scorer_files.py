"""Features of the scorer are read as they were written."""

import numpy as np

from capsule.detectors.described import (
    read_features,
    read_scorer,
    read_stretches,
    write_features,
    write_stretches,
)
from capsule.detectors.scorer import Features
from capsule.detectors.stretches import Stretches
from support.project import ROOT


def features_of(number):
    """Return features that differ between recordings."""
    gradient = np.arange(5, dtype=np.float32) - number
    return Features(float(number), np.full(3, number, np.float32), gradient)


def test_features_come_back_as_they_were_and_only_those_wanted(tmp_path):
    written = {f"{size}mm/r{run}": features_of(size + run) for size in (0, 3) for run in (1, 2)}
    paths = [tmp_path / "0mm.npz", tmp_path / "3mm.npz"]
    for path in paths:
        some = {name: each for name, each in written.items() if name.startswith(path.stem)}
        write_features(path, some)
    read = read_features(paths, ["0mm/r2", "3mm/r1"])
    assert set(read) == {"0mm/r2", "3mm/r1"}
    for name, features in read.items():
        np.testing.assert_equal(vars(features), vars(written[name]))


def test_a_folder_without_a_usable_recording_has_no_features(tmp_path):
    write_features(tmp_path / "0mm.npz", {})
    assert read_features([tmp_path / "0mm.npz"], ["0mm/r1"]) == {}


def test_the_weights_that_ship_make_a_scorer():
    scorer = read_scorer(ROOT / "workflow" / "weights" / "scorer.npz")
    assert np.isfinite(scorer.features(np.zeros((4, 5, 40))).score)


def test_stretches_come_back_as_they_were_and_only_those_wanted_and_known(tmp_path):
    written = {f"3mm/r{n}": Stretches(float(n), 3.5, 2.0, np.arange(n) / 4) for n in (2, 5)}
    paths = [tmp_path / "3mm.stretches.npz", tmp_path / "0mm.stretches.npz"]
    write_stretches(paths[0], {**written, "3mm/r7": None})
    write_stretches(paths[1], {})
    read = read_stretches(paths, ["0mm/r1", "3mm/r5", "3mm/r7"])
    assert set(read) == {"3mm/r5"}
    np.testing.assert_equal(vars(read["3mm/r5"]), vars(written["3mm/r5"]))
