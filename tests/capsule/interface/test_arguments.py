"""Arguments that cannot be used are refused with their name, their value and the remedy."""

import inspect
import pickle

import numpy as np
import pandas as pd
import pytest

import capsule
from support.project import ROOT

SHAPE = {"window": 84, "threshold": 1.0, "length": 1000}
FILE = ROOT / "raw/3mm/r01.csv"
NAME = "3mm/r01"
FUNCTIONS = {name: getattr(capsule, name) for name in capsule.__all__ if name.islower()}
# A new public function with readings or a matrix among its arguments is tested without a line here.
ON_ARRAYS = [
    (name, argument)
    for name, function in FUNCTIONS.items()
    for argument in inspect.signature(function).parameters
    if argument in {"values", "normalized", "matrix", "templates", "recording"}
]


def call(archive, name, changes):
    """Call a public function with allowed values of all arguments but the changed ones."""
    values = archive.readings[NAME]
    allowed = archive.fit_options | archive.template_options | SHAPE
    allowed |= dict.fromkeys(["values", "matrix", "normalized", "envelope"], values)
    allowed |= {"templates": [values], "generator": archive.generator(NAME), "stream": FILE}
    allowed |= {"seed": 1, "settings": archive.settings["fit"]}
    wanted = inspect.signature(FUNCTIONS[name]).parameters
    return FUNCTIONS[name](**{each: allowed[each] for each in wanted if each in allowed} | changes)


@pytest.mark.parametrize(("name", "argument"), ON_ARRAYS)
def test_samples_first_is_refused_with_the_remedy(archive, name, argument):
    tall, told = archive.readings[NAME].T, argument
    if argument == "templates":
        tall, told = [tall], "templates[0]"
    elif argument == "recording":
        tall, told = capsule.Recording(archive.time_s(NAME), tall), "recording.values"
    with pytest.raises(capsule.CapsuleError) as refused:
        call(archive, name, {argument: tall})
    shown = f"{told}: an array of shape (520, 4) is not allowed; allowed is one row per sensor"
    assert str(refused.value) == f"{shown}; transpose it: {told}.T has one row per sensor"
    assert len(ON_ARRAYS) >= 10
    # Few samples and many sensors are no samples first.
    for shape in ((1, 100), (4, 4), (64, 525)):
        values = np.arange(np.prod(shape), dtype=float).reshape(shape) ** 2
        assert capsule.normalize(values).shape == shape


def test_what_numpy_can_convert_is_taken(archive):
    values = archive.readings[NAME]
    made = capsule.preprocess(values, **SHAPE)
    for same in (values.tolist(), pd.DataFrame(values), np.asfortranarray(values)):
        np.testing.assert_array_equal(capsule.preprocess(same, **SHAPE), made)
    # The mask of an array is a missing sample, here and in an estimator's row.
    masked, lost = np.ma.masked_array(values, values < 460), np.where(values < 460, np.nan, values)
    assert 0 < np.isnan(lost).sum() < lost.size / 10
    made = capsule.preprocess(lost, **SHAPE)
    np.testing.assert_array_equal(capsule.preprocess(masked, **SHAPE), made)
    rows = [each.T.reshape(1, -1) for each in (masked, lost)]
    of_mask, of_nan = (capsule.MatrixTransformer().fit_transform(row) for row in rows)
    np.testing.assert_array_equal(of_mask, of_nan)
    # An envelope of a single sensor is clipped value by value.
    assert capsule.rectify([0.5, 1.5], 1).tolist() == [0.0, 0.5]


@pytest.mark.parametrize(
    ("name", "changed", "allowed"),
    [
        ("preprocess", {"length": 100}, "5.., the number of samples, or more"),
        ("preprocess", {"window": 84.0}, "a whole number of at least 1"),
        ("preprocess", {"window": True}, "a whole number of at least 1"),
        ("preprocess", {"threshold": np.nan}, "a number of at least 0"),
        ("preprocess", {"values": "readings"}, "an array of numbers, one row per sensor"),
        ("preprocess", {"values": [1.0, 2.0]}, "an array of numbers, one row per sensor"),
        ("fit_generator", {"seed": -1}, "a whole number of at least 0"),
        ("read_recording", {"sensors": 0}, "a whole number"),
        ("read_recording", {"stream": 3}, "a path, or a file that is open for reading"),
        ("render", {"particle": None}, "a Particle"),
        ("template_distances", {"templates": 3}, "a sequence of arrays"),
        ("format_recording", {"recording": NAME}, "a Recording"),
        ("load", {"raw": 3}, "a path to a folder of recordings"),
        ("folds", {"archive": "raw"}, "what capsule.load returns"),
    ],
)
def test_an_argument_is_refused_with_its_name_and_what_is_allowed(archive, name, changed, allowed):
    *_, argument = changed
    told = rf"\b{argument}: .* is not allowed; allowed is {allowed}"
    with pytest.raises(capsule.CapsuleError, match=told) as refused:
        call(archive, name, changed)
    # As users of numpy and scikit-learn expect of a wrong value.
    assert isinstance(refused.value, ValueError)


def test_what_is_wrong_with_the_readings_is_told_with_its_place_or_the_functions_name():
    with pytest.raises(ValueError, match=r"^values\[0, 1\]: inf is not allowed; allowed is a fin"):
        capsule.preprocess([[1.0, np.inf, 2.0]], **SHAPE)
    with pytest.raises(ValueError, match=r"^preprocess: a constant sensor cannot be normalized"):
        capsule.preprocess(np.ones((4, 500)), **SHAPE)
    # A checked function is found under its public name.
    assert pickle.loads(pickle.dumps(capsule.preprocess)) is capsule.preprocess
    assert list(inspect.signature(capsule.rms_envelope).parameters) == ["normalized", "window"]


def test_a_recording_is_read_from_a_path_as_from_a_file(tmp_path):
    with FILE.open("rb") as stream:
        read = capsule.read_recording(stream, 4)
    for path in (FILE, str(FILE)):
        np.testing.assert_array_equal(capsule.read_recording(path, 4).values, read.values)
    with pytest.raises(capsule.CapsuleError, match=r"none\.csv: it cannot be read: No such file"):
        capsule.read_recording(tmp_path / "none.csv", 4)
