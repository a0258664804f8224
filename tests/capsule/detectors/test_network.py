"""The taught scorer: its gradient, and what its score does and does not depend on."""

import numpy as np
import pytest

from capsule.detectors import network
from capsule.detectors.network import FOLDED, SERIES_ROWS, STRETCH_WIDTH, Scorer, standardised
from capsule.detectors.search import series_of
from capsule.detectors.wave import wave_of
from capsule.engine.configuration import read_config_file
from capsule.recordings.recording import read_recording
from capsule.seeding import generator
from support.project import ROOT

SETTINGS = read_config_file(ROOT / "config" / "config.yaml")["diagonal"]


@pytest.fixture(scope="module")
def weights():
    """Return the shipped weights."""
    return dict(np.load(ROOT / "workflow" / "weights" / "scorer.npz"))


@pytest.fixture(scope="module")
def scorer(weights):
    return Scorer(weights)


@pytest.fixture(scope="module")
def series():
    return 0.3 * generator(1, "beats").normal(size=(4, 5, 43)).cumsum(axis=2)


def test_the_gradient_is_that_of_the_score(weights, scorer, series):
    gradient, numbers = scorer.forward(standardised(series))[2](), generator(1, "direction")
    names = [name for name in weights if name not in ("gradient_scale", "projection")]
    step = 1e-7  # so small that no unit switches
    for _ in range(3):
        direction = {name: numbers.normal(size=weights[name].shape) for name in names}
        scores = []
        for along in (-step, step):
            moved = {name: weights[name] + along * way for name, way in direction.items()}
            scores.append(Scorer(weights | moved).forward(standardised(series))[0])
        slope = gradient @ np.concatenate([each.ravel() for each in direction.values()])
        assert np.diff(scores) / (2 * step) == pytest.approx(slope, rel=1e-4)


def test_the_gradient_is_folded_which_keeps_products_and_then_projected(weights, scorer):
    many = 0.3 * generator(1, "many").normal(size=(6, 4, 5, 30)).cumsum(axis=3)
    whole = np.array([scorer.forward(standardised(each))[2]() for each in many])
    whole /= float(weights["gradient_scale"])
    unprojected = Scorer(weights | {"projection": np.eye(FOLDED)})
    folded = np.array([unprojected.features(each).gradient for each in many])
    # The shipped projection was taught with these random numbers.
    sketch = generator(1, "scorer", "sketch")
    bucket = sketch.integers(FOLDED, size=whole.shape[1])
    signed = sketch.choice([-1.0, 1.0], size=whole.shape[1]) * whole[0]
    np.testing.assert_allclose(folded[0], np.bincount(bucket, signed, FOLDED), rtol=1e-4, atol=1e-6)
    products, wanted = folded @ folded.T, whole @ whole.T
    assert np.abs(products - wanted).max() < 0.15 * np.diag(wanted).max()
    projected = scorer.features(many[0]).gradient
    np.testing.assert_allclose(projected, folded[0] @ weights["projection"], rtol=1e-3, atol=1e-5)


def test_recordings_over_nodules_score_higher_than_those_without(scorer):
    scores = {"0mm": [], "1mm": [], "3mm": []}
    for folder, of_size in scores.items():
        for path in sorted((ROOT / "raw" / folder).glob("*.csv"))[::4]:
            with path.open("rb") as stream:
                values = read_recording(stream, 4, 10**6).values
            of_size.append(scorer.features(series_of(wave_of(values, 10, SETTINGS))).score)
    # Before any adaptation; 0.5 would be chance.
    for folder, least in (("3mm", 0.95), ("1mm", 0.6)):
        assert np.greater.outer(scores[folder], scores["0mm"]).mean() > least


def test_what_has_no_wave_or_other_sensors_has_no_score_and_no_stretches(scorer, series):
    usual, wave = scorer.features(series), 500 - 20 * np.sin(2 * np.pi * np.arange(800) / 32)
    for values in (np.tile(wave, (3, 1)), np.tile(wave[:100], (4, 1)), np.full((4, 800), 5.0)):
        made = series_of(wave_of(values, 10, SETTINGS))
        # As many numbers are stored of it.
        nothing = {name: known * np.nan for name, known in vars(usual).items()}
        np.testing.assert_equal(vars(scorer.features(made)), nothing)
        assert network.score_stretches(scorer, made) is None


def test_the_input_is_the_series_in_their_own_spreads_written_out(series):
    # One sensor is far too loud, and one is still.
    series = series * np.array([1.0, 0.2, 1000.0, 0.0])[:, np.newaxis, np.newaxis]
    made = standardised(series)
    assert made.shape == (4, 17, 43)
    np.testing.assert_allclose(made[:, 5:10], np.arcsinh(3 * series))
    # Of 43 values, the median is the 22nd and the 20 % quantile is the 9th.
    ordered = np.sort(series)
    spread = np.hypot(np.minimum((ordered[:, :, 21] - ordered[:, :, 8]) / 0.8416, 30.0), 0.03)
    own = np.clip(series / spread[:, :, np.newaxis], -8, 8)
    np.testing.assert_allclose(made[:, :5], own / 2)
    for place, row in enumerate((0, 1, 3)):
        for sensor in range(4):
            others = np.delete(own[:, row], sensor, axis=0).mean(axis=0)
            apart = (own[sensor, row] - others) / 2
            np.testing.assert_allclose(made[sensor, 10 + place], apart, atol=1e-12)
            np.testing.assert_allclose(made[sensor, 13 + place], np.log(spread[sensor, row]) + 1.5)
    np.testing.assert_array_equal(made[:, 16], 1.0)
    assert (made[2, :5].max(), made[2, 13]) == pytest.approx((4.0, np.log(30) + 1.5))


def convolved(values, weight, bias, dilation):
    """Return a convolution written out: zeros stand beyond both ends."""
    (_, count), (outputs, _, taps) = values.shape, weight.shape
    made = np.tile(bias[:, np.newaxis], count).astype(float)
    for output, column, tap in np.ndindex(outputs, count, taps):
        source = column + (tap - taps // 2) * dilation
        if 0 <= source < count:
            made[output, column] += weight[output, :, tap] @ values[:, source]
    return made


def test_the_score_is_that_of_the_layers_written_out(weights, scorer, series):
    w = {name: np.asarray(value, np.float64) for name, value in weights.items()}
    x = standardised(series[:, :, :15])
    own = [convolved(row, w["own_weight"], w["own_bias"], 1)[:, ::2] for row in x]
    hidden = np.concatenate([np.maximum(each, 0) for each in own])
    hidden = w["mix_weight"] @ hidden + w["mix_bias"][:, np.newaxis]
    for number, dilation in enumerate((1, 2, 4, 8, 4)):
        weight, bias = w[f"block_{number}_weight"], w[f"block_{number}_bias"]
        hidden = hidden + np.maximum(convolved(hidden, weight, bias, dilation), 0)
    pooled = w["pool_weight"] @ hidden + w["pool_bias"][:, np.newaxis]
    soft = np.logaddexp.reduce(pooled, axis=1) - np.log(pooled.shape[1])
    pooled = np.concatenate([pooled.mean(axis=1), pooled.max(axis=1), soft])
    squeezed = np.sign(pooled) * np.log(1 + np.abs(pooled))
    embedding = w["embed_weight"] @ squeezed + w["embed_bias"]
    score, found, _ = scorer.forward(x)
    np.testing.assert_allclose(found, embedding, rtol=1e-6)
    assert score == pytest.approx(w["score_weight"] @ embedding + w["score_bias"][0])
    assert scorer.features(series[:, :, :15]).score == score


def test_a_stretch_of_usual_beats_takes_the_place_of_each_and_loses_what_it_raised(scorer):
    series = 0.1 * np.sin(np.arange(800.0)).reshape(4, 5, 40)
    series[:, 1, 20:24] = 3.0
    whole, loss = network.score_stretches(scorer, series)
    assert whole == scorer.features(series).score
    for number, lost in enumerate(loss):
        x = standardised(series)
        x[:, :SERIES_ROWS, number * network.STRETCH_STEP :][:, :, :STRETCH_WIDTH] = 0.0
        assert lost == pytest.approx(whole - scorer.forward(x)[0])
    assert loss[18 // network.STRETCH_STEP] > 0
    # Usual beats are zero in what is taken out, and nothing is lost by them.
    usual = standardised(0 * series)
    assert not usual[:, :SERIES_ROWS].any() and usual[:, SERIES_ROWS:].all()
    assert not network.score_stretches(scorer, 0 * series)[1].any()
    # Those of a short recording stay within it.
    for beats in (1, 7, 8, 9, 10):
        _, loss = network.score_stretches(scorer, np.ones((4, 5, beats)))
        assert loss.size == max(beats - STRETCH_WIDTH, 0) // network.STRETCH_STEP + 1
    assert network.FIRST_STRETCH == 3.5  # the middle of eight beats
