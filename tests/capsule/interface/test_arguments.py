"""Arguments that cannot be used are refused with their name, their value and the remedy."""

import inspect
import pickle

import numpy as np
import pandas as pd
import pytest

import capsule
from support.project import ROOT

SHAPE = {"window": 84, "threshold": 1.0, "length": 1000}
SAMPLES_FIRST = "one row per sensor; transpose it: "
FILE = ROOT / "raw/3mm/r01.csv"


@pytest.fixture
def values(archive):
    return archive.readings["3mm/r01"]


@pytest.mark.parametrize(
    ("called", "argument"),
    [
        (lambda tall, good, archive: capsule.normalize(tall), "values"),
        (lambda tall, good, archive: capsule.rms_envelope(tall, 84), "normalized"),
        (lambda tall, good, archive: capsule.preprocess(tall, **SHAPE), "values"),
        (lambda tall, good, archive: capsule.preprocess(pd.DataFrame(tall), **SHAPE), "values"),
        (lambda tall, good, archive: capsule.fit_generator(1, tall), "values"),
        (
            lambda tall, good, archive: capsule.fit_particle(
                tall, archive.generator("3mm/r01"), **archive.fit_options
            ),
            "matrix",
        ),
        (
            lambda tall, good, archive: capsule.fit_recording(tall, good, archive.settings["fit"]),
            "matrix",
        ),
        (
            lambda tall, good, archive: capsule.fit_recording(good, tall, archive.settings["fit"]),
            "values",
        ),
        (lambda tall, good, archive: capsule.template_distances(tall, [good]), "matrix"),
        (lambda tall, good, archive: capsule.template_distances(good, [tall]), "templates[0]"),
        (
            lambda tall, good, archive: capsule.format_recording(
                capsule.Recording(archive.time_s("3mm/r01"), tall)
            ),
            "recording.values",
        ),
    ],
)
def test_samples_first_is_refused_with_the_remedy(archive, values, called, argument):
    with pytest.raises(capsule.CapsuleError) as refused:
        called(values.T, values, archive)
    remedy = f"{SAMPLES_FIRST}{argument}.T has one row per sensor"
    shown = f"{argument}: an array of shape {values.T.shape} is not allowed; allowed is {remedy}"
    assert str(refused.value) == shown


def test_every_function_on_arrays_has_a_test_above():
    """A new public function with readings or a matrix among its arguments needs the check, too."""
    on_arrays = {"values", "normalized", "matrix", "templates", "recording"}
    functions = [getattr(capsule, name) for name in capsule.__all__ if name.islower()]
    found = {f.__name__ for f in functions if on_arrays & set(inspect.signature(f).parameters)}
    assert found == {
        "normalize",
        "rms_envelope",
        "preprocess",
        "fit_generator",
        "fit_particle",
        "fit_recording",
        "template_distances",
        "format_recording",
    }


@pytest.mark.parametrize("made_of", [capsule.DetectorEstimator, capsule.MatrixTransformer])
def test_an_estimator_refuses_the_samples_of_one_recording(archive, values, made_of):
    told = (
        f"X: {len(values.T)} rows of 4 readings are the samples of one recording; a row of X holds"
    )
    unfitted = made_of(settings=archive.settings)
    with pytest.raises(capsule.CapsuleError, match=told):
        unfitted.fit(values.T, np.full(len(values.T), 3.0))
    fitted = unfitted.fit(archive.X, archive.y)
    use = fitted.transform if made_of is capsule.MatrixTransformer else fitted.predict
    with pytest.raises(capsule.CapsuleError, match=told):
        use(values.T)
    # What the message proposes.
    assert np.isfinite(use(archive.rows(["3mm/r01"]))).all()


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


@pytest.mark.parametrize(
    ("changed", "told"),
    [
        ({"length": 100}, "length: 100 is not allowed; allowed is 5.., the number of samples"),
        ({"length": 0}, "length: 0 is not allowed; allowed is a whole number of at least 1"),
        ({"length": "long"}, "length: 'long' is not allowed; allowed is a whole number"),
        ({"window": -3}, "window: -3 is not allowed; allowed is a whole number of at least 1"),
        ({"window": 0}, "window: 0 is not allowed; allowed is a whole number of at least 1"),
        ({"window": 84.0}, "window: 84.0 is not allowed; allowed is a whole number"),
        ({"window": True}, "window: True is not allowed; allowed is a whole number"),
        ({"window": None}, "window: None is not allowed; allowed is a whole number"),
        ({"threshold": -1}, "threshold: -1 is not allowed; allowed is a number of at least 0"),
        ({"threshold": np.nan}, "threshold: nan is not allowed; allowed is a number"),
        ({"threshold": "1"}, "threshold: '1' is not allowed; allowed is a number"),
        ({"values": "readings"}, "values: 'readings' is not allowed; allowed is an array of num"),
        ({"values": None}, "values: None is not allowed; allowed is an array of numbers"),
        ({"values": [1.0, 2.0]}, r"values: an array of shape \(2,\) is not allowed"),
        (
            {"values": [[1.0, np.inf, 2.0]]},
            r"values\[0, 1\]: inf is not allowed; allowed is a finite",
        ),
        ({"values": np.empty((4, 0))}, r"values: an array of shape \(4, 0\) is not allowed"),
        ({"values": np.ones((4, 500))}, "preprocess: a constant sensor cannot be normalized"),
    ],
)
def test_an_argument_is_refused_with_its_name_its_value_and_what_is_allowed(values, changed, told):
    arguments = {"values": values, **SHAPE, **changed}
    with pytest.raises(capsule.CapsuleError, match=told) as refused:
        capsule.preprocess(**arguments)
    # As users of numpy and scikit-learn expect of a wrong value.
    assert isinstance(refused.value, ValueError)


@pytest.mark.parametrize(
    ("called", "told"),
    [
        (lambda archive: capsule.rms_envelope(archive.readings["3mm/r01"], 0), "window: 0 is"),
        (lambda archive: capsule.rectify([1.0], None), "threshold: None is"),
        (lambda archive: capsule.fit_generator(-1, archive.readings["3mm/r01"]), "seed: -1 is"),
        (lambda archive: capsule.read_recording(FILE, 0), "sensors: 0 is"),
        (lambda archive: capsule.read_recording(FILE, 4, max_bytes=-1), "max_bytes: -1 is"),
        (
            lambda archive: capsule.build_templates({}, sensors=4, first_peak=0, length=10),
            "first_peak: 0 is",
        ),
        (
            lambda archive: capsule.render(archive.fit("3mm/r01").particle, 150, 0),
            "length: 0 is",
        ),
        (
            lambda archive: capsule.fit_particle(
                archive.matrices["3mm/r01"],
                archive.generator("3mm/r01"),
                **archive.fit_options | {"particles": 0},
            ),
            "particles: 0 is",
        ),
        (
            lambda archive: capsule.fit_particle(
                archive.matrices["3mm/r01"], 1, **archive.fit_options
            ),
            "generator: 1 is not allowed; allowed is a Generator",
        ),
        (lambda archive: capsule.render(None, 150, 10), "particle: None is not allowed"),
        (
            lambda archive: capsule.template_distances(archive.matrices["3mm/r01"], 3),
            "templates: 3 is not allowed; allowed is a sequence of arrays",
        ),
        (lambda archive: capsule.format_recording("3mm/r01"), "recording: '3mm/r01' is"),
        (lambda archive: capsule.load(3), "raw: 3 is not allowed; allowed is a path"),
        (lambda archive: capsule.folds("raw"), "archive: 'raw' is not allowed; allowed is what"),
        (lambda archive: capsule.judge("raw"), "archive: 'raw' is not allowed; allowed is what"),
        (lambda archive: capsule.DetectorEstimator("best").fit(archive.X, archive.y), "best"),
        (
            lambda archive: capsule.DetectorEstimator(settings={"fit": {}}).fit(
                archive.X, archive.y
            ),
            r"settings: \{'fit': \{\}\} is not allowed; allowed is a configuration such as archive",
        ),
    ],
)
def test_other_functions_refuse_in_the_same_way(archive, called, told):
    with pytest.raises(capsule.CapsuleError, match=told):
        called(archive)


def test_a_checked_function_is_found_under_its_public_name():
    assert pickle.loads(pickle.dumps(capsule.preprocess)) is capsule.preprocess
    assert capsule.preprocess is capsule.preprocess
    assert list(inspect.signature(capsule.rms_envelope).parameters) == ["normalized", "window"]


def test_the_manual_tells_the_standard_deviation_that_is_used(values):
    deviation = values.std(axis=1, ddof=1, keepdims=True)
    expected = (values - values.mean(axis=1, keepdims=True)) / deviation
    np.testing.assert_allclose(capsule.normalize(values), expected)
    for page in ("method.md", "library.md"):
        text = " ".join((ROOT / "docs" / page).read_text(encoding="utf-8").split())
        assert "sample standard deviation" in text and "`ddof=1` in numpy" in text


@pytest.mark.parametrize("path", [FILE, str(FILE)])
def test_a_recording_is_read_from_a_path_as_from_a_file(path):
    with FILE.open("rb") as stream:
        read = capsule.read_recording(stream, 4)
    from_path = capsule.read_recording(path, sensors=4)
    np.testing.assert_array_equal(from_path.values, read.values)
    np.testing.assert_array_equal(from_path.time_s, read.time_s)
    assert from_path.header == read.header


def test_a_path_that_cannot_be_read_is_refused_with_its_name(tmp_path):
    with pytest.raises(capsule.CapsuleError, match=r"none\.csv: it cannot be read: No such file"):
        capsule.read_recording(tmp_path / "none.csv", 4)
    with pytest.raises(capsule.CapsuleError, match="stream: 3 is not allowed; allowed is a path"):
        capsule.read_recording(3, 4)
