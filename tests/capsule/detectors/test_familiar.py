"""A recording is unfamiliar if hardly any that teaches deviates as far."""

import json
from dataclasses import astuple, replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from capsule.detectors.base import TrainingArchive
from capsule.detectors.calibrate import upper_quantile
from capsule.detectors.familiar import LEAST_PLACES, NO_WAVE, FamiliarKind, learn_familiar
from capsule.detectors.unlike import because, familiarity_line, unlike_because
from capsule.detectors.wave_traits import UNKNOWN_TRAITS, WaveTraits
from capsule.seeding import generator
from support.training import NO_TEMPLATES, recordings_of

USUAL = WaveTraits(3.2, 0.25, 0.02, 0.005, 0.95, 0.1)


def traits_like(numbers, count, spread=1.0):
    """Return traits (n, 6) that scatter around the usual ones, by far more than what matters."""
    factors = spread * numbers.normal(0, 1, (count, 6)) * [0.1, 0.1, 1.0, 1.0, 0.0, 0.5]
    traits = np.array(astuple(USUAL)) * np.exp(factors)
    odds = np.log(0.95 / 0.05) + np.ravel(spread) * numbers.normal(0, 2.0, count)
    traits[:, 4] = 1 / (1 + np.exp(-odds))
    return traits


KIND_TRAITS = traits_like(generator(1, "kind"), 120)


def kind_of(count=120, passes=1):
    return learn_familiar(KIND_TRAITS[:count], np.arange(count) // passes)


def scaled(traits):
    period, step, spread, unsteadiness, share, noise = traits.T
    share = share.clip(0.001, 0.999)
    times = np.log(period), step / period, np.log(spread / period + 0.003)
    others = np.log(unsteadiness + 0.002), np.log(share / (1 - share)), np.log(noise)
    return np.transpose([*times, *others])


# What must differ in the logarithms, the shares of a period and the logit.
LEAST = [0.03, 0.003, 0.4, 0.35, 1.0, 0.2]


def usual(rows):
    """Return mean and spread of scaled traits."""
    return rows.mean(axis=0), np.maximum(rows.std(axis=0, ddof=1), LEAST)


def deviation(own, others):
    centre, spread = usual(others)
    return (np.abs(own - centre) / spread).max()


@given(st.integers(0, 1000), st.integers(1, 3))
def test_what_is_familiar_is_that_of_the_formula_written_out(seed, passes):
    numbers = np.random.default_rng(seed)
    places = np.repeat(np.arange(55), 1 + np.arange(55) % passes)
    traits = traits_like(numbers, places.size)
    # One place lies apart, so that the limit is above 3.
    traits[places == 7, 0] *= 3
    rows, kind = scaled(traits), learn_familiar(traits, places)
    np.testing.assert_allclose([kind.centre, kind.spread], usual(rows))
    far = [deviation(row, rows[places != place]) for row, place in zip(rows, places, strict=True)]
    limit = upper_quantile(np.array(far), places, 0.98)
    assert kind.limit == pytest.approx(limit) and limit > 3
    judged = traits_like(numbers, 4, spread=2.5)
    asked = [*(WaveTraits(*own) for own in judged), UNKNOWN_TRAITS]
    *answers, unknown = kind.judge_all(asked)
    expected = [deviation(own, rows) <= limit for own in scaled(judged)]
    assert [each.familiar for each in answers] == expected
    assert (unknown.familiar, unknown.traits) == (None, (NO_WAVE,))
    assert familiarity_line(unknown.cells).endswith("the recording shows no wave to compare")
    assert [*answers, unknown] == [*map(kind.judge, asked)] == kind.judge_all(asked[::-1])[::-1]


@pytest.mark.parametrize(
    ("field", "value", "said"),
    [
        ("period_s", 6.4, "6.40 s"),
        ("step_s", -0.25, "\u22120.250 s"),
        ("step_spread_s", 1.5, "1.50 s"),
        ("unsteadiness", 0.9, "90.0 %"),
        ("wave_share", 0.01, "1.00 %"),
        ("noise", 5.0, "500 %"),
    ],
)
def test_another_trait_is_named_with_its_number_and_the_range(field, value, said):
    kind = kind_of()
    assert kind.judge(USUAL).familiar is True
    cells = kind.judge(replace(USUAL, **{field: value})).cells
    assert cells["unfamiliar_because"].split()[0] == field
    assert (cells["familiar"], cells["unlike_value"]) == ("no", value)
    column = KIND_TRAITS[:, list(vars(USUAL)).index(field)]
    assert (cells["unlike_least"], cells["unlike_most"]) == (column.min(), column.max())
    reason = unlike_because(cells)
    assert f" {said}" in reason.partition(", but ")[0] and "recordings that teach" in reason
    assert familiarity_line(cells) == f"unlike the recordings that teach: {reason}"
    assert unlike_because(cells | {"unlike_recording": "b"}) == f"b: {reason}"


def test_a_small_difference_does_not_matter_though_no_recording_that_teaches_has_it():
    same = np.tile(astuple(USUAL), (60, 1))
    same[:, 0] += np.linspace(0, 1e-6, 60)
    kind = learn_familiar(same, np.arange(60))
    assert kind.limit == 3.0
    np.testing.assert_allclose(kind.spread, LEAST)
    assert kind.judge(replace(USUAL, period_s=3.48)).familiar is True
    assert kind.judge(replace(USUAL, period_s=3.52)).familiar is False


def test_fewer_places_than_the_rate_needs_can_tell_nothing():
    assert LEAST_PLACES == 49
    far = replace(USUAL, period_s=30.0)
    # Passes over one place are one voice.
    for count, passes, familiar in ((49, 1, False), (48, 1, None), (98, 2, False), (96, 2, None)):
        assert kind_of(count, passes).judge(far).familiar is familiar
    few = kind_of(48).judge(far).cells
    assert because(few) == "only 48 places teach what is familiar; 49 are needed"
    assert few["familiar"] == ""
    # Recordings that are left out teach nothing.
    taught = recordings_of(traits={f"0mm/{number}": USUAL for number in range(60)})
    archive = TrainingArchive(dict.fromkeys(taught, 0.0), taught, NO_TEMPLATES, {}, {})
    assert FamiliarKind.taught(archive, list(taught)[:5]).places == 55


def test_the_trait_that_deviates_most_comes_first_and_the_others_are_counted():
    several = kind_of().judge(replace(USUAL, step_s=-3.0, noise=9.0, unsteadiness=0.9))
    assert several.traits == ("step_s", "noise", "unsteadiness")
    assert "; 2 other traits" in unlike_because(several.cells)
    # The time from sensor to sensor counts in periods, so it stays usual.
    alone = kind_of().judge(replace(USUAL, step_s=2.5, period_s=32.0))
    assert alone.traits == ("period_s",) and "other trait" not in unlike_because(alone.cells)


# A single sensor, which has no steps, is judged by the other traits.
@pytest.mark.parametrize("unknown", [[1, 2], []], ids=["one sensor", "four sensors"])
def test_what_is_stored_judges_as_what_was_learned(unknown):
    traits = traits_like(generator(1, "stored"), 100, np.repeat([[1.0], [2.0]], [60, 40], axis=0))
    traits[:, unknown] = np.nan
    kind, few = learn_familiar(traits[:60], np.arange(60)), kind_of(3)
    stored = (json.dumps(each.stored(), allow_nan=False) for each in (kind, few))
    restored, restored_few = (FamiliarKind.restored(json.loads(each)) for each in stored)
    asked = [WaveTraits(*row) for row in traits[60:]]
    answers = kind.judge_all(asked)
    assert restored.judge_all(asked) == answers
    assert {each.familiar for each in answers} == {True, False}
    assert restored_few.judge(USUAL).familiar is None
