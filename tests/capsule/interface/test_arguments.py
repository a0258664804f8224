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
OF_ARRAYS = {"values", "normalized", "matrix", "templates", "recording"}
# A new public function with readings or a matrix among its arguments is tested without a line here.
ON_ARRAYS = [
    (name, argument)
    for name, function in FUNCTIONS.items()
    for argument in inspect.signature(function).parameters
    if argument in OF_ARRAYS
]


@pytest.fixture
def values(archive):
    return archive.readings[NAME]


def call(archive, name, changes):
    """Call a public function with allowed values of all arguments but the changed ones."""
    values = archive.readings[NAME]
    allowed = archive.fit_options | archive.template_options | SHAPE
    allowed |= {"values": values, "matrix": values, "normalized": values, "templates": [values]}
    allowed |= {
        "seed": 1,
        "generator": archive.generator(NAME),
        "settings": archive.settings["fit"],
    }
    allowed |= {"particle": archive.fit(NAME).particle, "envelope": values, "stream": FILE}
    given = {each: allowed.get(each) for each in inspect.signature(FUNCTIONS[name]).parameters}
    given = {each: value for each, value in given.items() if value is not None}
    return FUNCTIONS[name](**given | changes)


@pytest.mark.parametrize(("name", "argument"), ON_ARRAYS)
def test_samples_first_is_refused_with_the_remedy(archive, values, name, argument):
    tall, told = values.T, argument
    if argument == "templates":
        tall, told = [tall], "templates[0]"
    elif argument == "recording":
        tall, told = capsule.Recording(archive.time_s(NAME), tall), "recording.values"
    with pytest.raises(capsule.CapsuleError) as refused:
        call(archive, name, {argument: tall})
    remedy = f"one row per sensor; transpose it: {told}.T has one row per sensor"
    shown = f"{told}: an array of shape {values.T.shape} is not allowed; allowed is {remedy}"
    assert str(refused.value) == shown
    assert len(ON_ARRAYS) >= 10


@pytest.mark.parametrize("made_of", [capsule.DetectorEstimator, capsule.MatrixTransformer])
def test_an_estimator_refuses_the_samples_of_one_recording(archive, values, made_of):
    told = f"X: {len(values.T)} rows of 4 readings are the samples of one recording; a row of X"
    unfitted = made_of(settings=archive.settings)
    with pytest.raises(capsule.CapsuleError, match=told):
        unfitted.fit(values.T, np.full(len(values.T), 3.0))
    fitted = unfitted.fit(archive.X, archive.y)
    use = fitted.transform if made_of is capsule.MatrixTransformer else fitted.predict
    with pytest.raises(capsule.CapsuleError, match=told):
        use(values.T)
    # What the message proposes.
    assert np.isfinite(use(archive.rows([NAME]))).all()


@pytest.mark.parametrize("shape", [(1, 100), (4, 4), (3, 84), (64, 525)])
def test_few_samples_and_many_sensors_are_no_samples_first(shape):
    values = np.arange(np.prod(shape), dtype=float).reshape(shape) ** 2
    assert capsule.normalize(values).shape == shape


def test_what_numpy_can_convert_is_taken(values):
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
    assert capsule.rectify(np.array([0.5, 1.5]), 1.0).tolist() == [0.0, 0.5]
    assert capsule.rectify([0.5, 1.5], 0).tolist() == [0.5, 1.5]


@pytest.mark.parametrize(
    ("name", "changed", "allowed"),
    [
        ("preprocess", {"length": 100}, "5.., the number of samples, or more"),
        ("preprocess", {"length": 0}, "a whole number of at least 1"),
        ("preprocess", {"window": 84.0}, "a whole number of at least 1"),
        ("preprocess", {"window": True}, "a whole number of at least 1"),
        ("preprocess", {"window": None}, "a whole number of at least 1"),
        ("preprocess", {"threshold": -1}, "a number of at least 0"),
        ("preprocess", {"threshold": np.nan}, "a number of at least 0"),
        ("preprocess", {"threshold": "1"}, "a number of at least 0"),
        ("preprocess", {"values": "readings"}, "an array of numbers, one row per sensor"),
        ("preprocess", {"values": None}, "an array of numbers, one row per sensor"),
        ("preprocess", {"values": [1.0, 2.0]}, "an array of numbers, one row per sensor"),
        ("preprocess", {"values": np.empty((4, 0))}, "an array of numbers, one row per sensor"),
        ("rectify", {"threshold": None}, "a number"),
        ("fit_generator", {"seed": -1}, "a whole number of at least 0"),
        ("read_recording", {"sensors": 0}, "a whole number"),
        ("read_recording", {"max_bytes": -1}, "a whole number"),
        ("read_recording", {"stream": 3}, "a path, or a file that is open for reading"),
        ("build_templates", {"particles": {}, "first_peak": 0}, "a whole number"),
        ("render", {"particle": None}, "a Particle"),
        ("fit_particle", {"particles": 0}, "a whole number"),
        ("fit_particle", {"generator": 1}, "a Generator"),
        ("template_distances", {"templates": 3}, "a sequence of arrays"),
        ("format_recording", {"recording": NAME}, "a Recording"),
        ("load", {"raw": 3}, "a path to a folder of recordings"),
        ("folds", {"archive": "raw"}, "what capsule.load returns"),
        ("judge", {"archive": "raw"}, "what capsule.load returns"),
    ],
)
def test_an_argument_is_refused_with_its_name_and_what_is_allowed(archive, name, changed, allowed):
    *_, argument = changed
    told = rf"\b{argument}: .* is not allowed; allowed is {allowed}"
    with pytest.raises(capsule.CapsuleError, match=told) as refused:
        call(archive, name, changed)
    # As users of numpy and scikit-learn expect of a wrong value.
    assert isinstance(refused.value, ValueError)


@pytest.mark.parametrize(
    ("values", "told"),
    [
        ([[1.0, np.inf, 2.0]], r"^values\[0, 1\]: inf is not allowed; allowed is a finite number"),
        (np.ones((4, 500)), "^preprocess: a constant sensor cannot be normalized"),
    ],
)
def test_what_is_wrong_with_the_readings_is_told_with_its_place(values, told):
    with pytest.raises(ValueError, match=told):
        capsule.preprocess(values, **SHAPE)


@pytest.mark.parametrize(
    ("options", "told"), [({"detector": "best"}, "best"), ({"settings": {"fit": {}}}, "settings: ")]
)
def test_an_estimator_refuses_what_it_was_made_of_when_it_is_fitted(archive, options, told):
    with pytest.raises(capsule.CapsuleError, match=told):
        capsule.DetectorEstimator(**options).fit(archive.X, archive.y)


def test_a_checked_function_is_found_under_its_public_name():
    assert pickle.loads(pickle.dumps(capsule.preprocess)) is capsule.preprocess
    assert list(inspect.signature(capsule.rms_envelope).parameters) == ["normalized", "window"]


@pytest.mark.parametrize("path", [FILE, str(FILE)])
def test_a_recording_is_read_from_a_path_as_from_a_file(path, tmp_path):
    with FILE.open("rb") as stream:
        read = capsule.read_recording(stream, 4)
    from_path = capsule.read_recording(path, sensors=4)
    np.testing.assert_array_equal(from_path.values, read.values)
    assert from_path.header == read.header
    with pytest.raises(capsule.CapsuleError, match=r"none\.csv: it cannot be read: No such file"):
        capsule.read_recording(tmp_path / "none.csv", 4)
