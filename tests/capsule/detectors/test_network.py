"""The taught scorer: its gradient, and what its score does and does not depend on."""

import numpy as np
import pytest

from capsule.configuration import read_config_file
from capsule.detectors.beats import series_of
from capsule.detectors.network import FOLDED, Scorer, features_of, standardised
from capsule.evaluation.roc import auc
from capsule.recording import read_recording
from capsule.seeding import generator
from support.project import ROOT

SETTINGS = read_config_file(ROOT / "config" / "config.yaml")["diagonal"]
# Readings above the full scale are used as they are.
LINEAR = SETTINGS | {"full_scale": 100}


@pytest.fixture(scope="module")
def weights():
    """Return the shipped weights."""
    with np.load(ROOT / "workflow" / "weights" / "scorer.npz") as stored:
        return dict(stored.items())


@pytest.fixture(scope="module")
def scorer(weights):
    return Scorer(weights)


@pytest.fixture(scope="module")
def unprojected(weights):
    """Return the scorer that only folds its gradients."""
    return Scorer(weights | {"projection": np.eye(FOLDED)})


@pytest.fixture(scope="module")
def series():
    return 0.3 * generator(1, "beats").normal(size=(4, 5, 41)).cumsum(axis=2)


def readings(samples=800, deeper=0.0):
    """Return the readings of four sensors that a wave presses."""
    time = np.arange(samples)
    wave = np.sin(2 * np.pi * time / 32) + 0.2 * np.sin(4 * np.pi * time / 32)
    noise = generator(1, "readings").normal(0, 0.05, (4, samples))
    middle = 150 + 150 * np.arange(4)[:, np.newaxis]
    bump = deeper * np.exp(-(((time - middle) / 40) ** 2))
    return 500 - 20 * (1 + bump) * (wave + noise)


def test_the_gradient_is_that_of_the_score(weights, series):
    scorer = Scorer(weights)
    score, _, backward = scorer.forward(standardised(series))
    gradient = backward()
    numbers = generator(1, "direction")
    names = [name for name in weights if name not in ("gradient_scale", "projection")]
    step = 1e-7  # so small that no unit switches
    for _ in range(5):
        direction = {name: numbers.normal(size=weights[name].shape) for name in names}
        moved = [
            Scorer(weights | {n: weights[n] + sign * step * direction[n] for n in names})
            for sign in (1, -1)
        ]
        ahead, behind = (each.forward(standardised(series))[0] for each in moved)
        slope = gradient @ np.concatenate([direction[name].ravel() for name in names])
        assert (ahead - behind) / (2 * step) == pytest.approx(slope, rel=1e-4)
    assert np.isfinite(score)


def test_folding_keeps_products_of_gradients(weights, unprojected):
    numbers = generator(1, "many")
    many = [0.3 * numbers.normal(size=(4, 5, 30)).cumsum(axis=2) for _ in range(12)]
    whole = np.array([unprojected.forward(standardised(each))[2]() for each in many])
    whole /= float(weights["gradient_scale"])
    folded = np.array([unprojected.features(each).gradient for each in many])
    products, wanted = folded @ folded.T, whole @ whole.T
    assert np.abs(products - wanted).max() < 0.15 * np.diag(wanted).max()


def test_the_gradient_is_folded_and_then_projected(weights, scorer, unprojected, series):
    folded, projected = unprojected.features(series), scorer.features(series)
    expected = [sum(folded.gradient * column) for column in weights["projection"].T]
    np.testing.assert_allclose(projected.gradient, expected, rtol=1e-3, atol=1e-5)
    assert projected.score == folded.score


def test_the_score_does_not_depend_on_gain_or_rest(weights):
    scorer = Scorer(weights)
    plain = features_of(readings(deeper=1.0), 10, LINEAR, scorer)
    other = features_of(300 + 1.7 * readings(deeper=1.0), 10, LINEAR, scorer)
    assert other.score == pytest.approx(plain.score, abs=1e-6)


def test_recordings_over_nodules_score_higher_than_those_without(weights):
    scorer = Scorer(weights)

    def scores(folder):
        for path in sorted((ROOT / "raw" / folder).glob("*.csv")):
            with path.open("rb") as stream:
                values = read_recording(stream, 4, 10**6).values
            yield features_of(values, 10, SETTINGS, scorer).score

    healthy = np.array(list(scores("0mm")))
    # Before any adaptation; 0.5 would be chance.
    assert auc(healthy, np.array(list(scores("3mm")))) > 0.95
    assert auc(healthy, np.array(list(scores("1mm")))) > 0.6


def test_what_has_no_wave_or_other_sensors_has_no_score(weights):
    scorer = Scorer(weights)
    for values in (readings()[:3], readings(100), np.full((4, 800), 5.0)):
        features = features_of(values, 10, SETTINGS, scorer)
        assert np.isnan(features.score) and np.isnan(features.gradient).all()


def test_the_series_of_a_steady_wave_is_flat():
    series = series_of(readings(), 10, LINEAR)
    assert series.shape[:2] == (4, 5)
    # A wave every 8 windows' worth of a quarter: 800 samples less one wave.
    assert series.shape[2] == pytest.approx((800 - 32) / 8, abs=2)
    assert np.abs(series[:, 1]).max() < 0.2


def test_a_deeper_beat_stands_where_the_sensor_meets_the_nodule():
    series = series_of(readings(deeper=1.0), 10, LINEAR)
    highest = series[:, 1].argmax(axis=1) * 8 + 16
    np.testing.assert_allclose(highest, 150 + 150 * np.arange(4), atol=24)
