"""A recording is unfamiliar if hardly any that teaches deviates as far."""

import json
from dataclasses import astuple, replace

import numpy as np
import pytest

from capsule.detectors.base import TrainingArchive
from capsule.detectors.calibrate import upper_quantile
from capsule.detectors.familiar import NO_WAVE, FamiliarKind, learn_familiar
from capsule.detectors.unlike import because, familiarity_line, unlike_because
from capsule.detectors.wave_traits import UNKNOWN_TRAITS, WaveTraits
from capsule.seeding import generator
from support.training import NO_TEMPLATES, recordings_of

USUAL = WaveTraits(3.2, 0.25, 0.02, 0.005, 0.95, 0.1)


def traits_like(numbers, count, spread=1.0):
    """Return traits (n, 6) that scatter around the usual ones, by far more than what matters."""
    factors = spread * numbers.normal(0, 1, (count, 6)) * [0.1, 0.1, 1.0, 1.0, 2.0, 0.5]
    traits = np.array(astuple(USUAL)) * np.exp(factors)
    # The share of the wave scatters in its odds.
    traits[:, 4] = 1 / (1 + 0.05 / 0.95 * np.exp(-factors[:, 4]))
    return traits


KIND_TRAITS = traits_like(generator(1, "kind"), 120)


def kind_of(count=120, passes=1):
    return learn_familiar(KIND_TRAITS[:count], np.arange(count) // passes)


def scaled(traits):
    period, step, spread, unsteadiness, share, noise = traits.T
    odds = share.clip(0.001, 0.999) / (1 - share.clip(0.001, 0.999))
    logarithms = np.log([period, spread / period + 0.003, unsteadiness + 0.002, odds, noise])
    return np.insert(logarithms, 1, step / period, axis=0).T


# What must differ in the logarithms, the shares of a period and the logit.
LEAST = [0.03, 0.003, 0.4, 0.35, 1.0, 0.2]


def usual(rows):
    """Return mean and spread of scaled traits."""
    return rows.mean(axis=0), np.maximum(rows.std(axis=0, ddof=1), LEAST)


def deviation(own, others):
    centre, spread = usual(others)
    return (np.abs(own - centre) / spread).max()


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("passes", [1, 2, 3])
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


def test_another_trait_is_named_with_its_number_and_the_range():
    assert kind_of().judge(USUAL).familiar is True
    values = 6.4, -0.25, 1.5, 0.9, 0.01, 5.0
    said = "6.40 s", "\u22120.250 s", "1.50 s", "90.0 %", "1.00 %", "500 %"
    for field, value, text, column in zip(vars(USUAL), values, said, KIND_TRAITS.T, strict=True):
        cells = kind_of().judge(replace(USUAL, **{field: value})).cells
        familiar, traits, *numbers = cells.values()
        assert (familiar, traits.split()[0]) == ("no", field)
        assert numbers == [value, column.min(), column.max()]
        reason = unlike_because(cells)
        assert f" {text}" in reason.partition(", but ")[0]
        assert familiarity_line(cells) == f"unlike the recordings that teach: {reason}"
        assert unlike_because(cells | {"unlike_recording": "b"}) == f"b: {reason}"
    # The trait that deviates most comes first, and the others are counted.
    several = kind_of().judge(replace(USUAL, step_s=-3.0, noise=9.0, unsteadiness=0.9))
    assert several.traits == ("step_s", "noise", "unsteadiness")
    assert "; 2 other traits" in unlike_because(several.cells)
    # The time from sensor to sensor counts in periods, so it stays usual.
    assert kind_of().judge(replace(USUAL, step_s=2.5, period_s=32.0)).traits == ("period_s",)


def test_a_small_difference_does_not_matter_though_no_recording_that_teaches_has_it():
    kind = learn_familiar(np.tile(astuple(USUAL), (60, 1)), np.arange(60))
    assert kind.limit == 3.0
    np.testing.assert_allclose(kind.spread, LEAST)
    for period_s, familiar in ((3.48, True), (3.52, False)):
        assert kind.judge(replace(USUAL, period_s=period_s)).familiar is familiar


def test_fewer_places_than_the_rate_needs_can_tell_nothing():
    far = replace(USUAL, period_s=30.0)
    # Passes over one place are one voice.
    for count, passes, familiar in ((49, 1, False), (48, 1, None), (98, 2, False), (96, 2, None)):
        assert kind_of(count, passes).judge(far).familiar is familiar
    few = kind_of(48).judge(far).cells
    assert because(few) == "only 48 places teach what is familiar; 49 are needed"
    # Recordings that are left out teach nothing.
    taught = recordings_of(traits={f"0mm/{number}": USUAL for number in range(60)})
    archive = TrainingArchive(dict.fromkeys(taught, 0.0), taught, NO_TEMPLATES, {}, {})
    assert FamiliarKind.taught(archive, list(taught)[:5]).places == 55


# A single sensor, which has no steps, is judged by the other traits.
@pytest.mark.parametrize("unknown", [[1, 2], []], ids=["one sensor", "four sensors"])
def test_what_is_stored_judges_as_what_was_learned(unknown):
    traits = traits_like(generator(1, "stored"), 100, np.repeat([[1.0], [2.0]], [60, 40], axis=0))
    traits[:, unknown] = np.nan
    asked = [WaveTraits(*row) for row in traits[60:]]
    # Three places tell of none.
    for count, familiar in ((60, {True, False}), (3, {None})):
        kind = learn_familiar(traits[:count], np.arange(count))
        stored = json.loads(json.dumps(kind.stored(), allow_nan=False))
        answers = kind.judge_all(asked)
        assert FamiliarKind.restored(stored).judge_all(asked) == answers
        assert {each.familiar for each in answers} == familiar
