"""What the report answers first, worked out by counting."""

import pandas as pd
import pytest

from capsule.evaluation import answers as told
from capsule.evaluation.answers import Estimate, answers_of, false_alarms, predictive_values
from capsule.evaluation.archive_rates import Lead, Rates
from capsule.evaluation.intervals import rate, recordings_needed
from support.evaluated import RULES, UNKNOWN, evaluated, index_of

SETTINGS = {"fit": {"seed": 1}, "evaluation": RULES}
SETTINGS |= {"report": {"reliable_rate": 0.85, "lead": "best"}}
OF_RULE = ("template", "leave_one_out")


def rates_of(evaluation):
    """Return the rates of an evaluation in which each recording is a place."""
    labels = evaluation.predictions.drop_duplicates("recording")[["recording", "size_mm"]]
    rows = [[*label, "accepted", UNKNOWN, "bench", "aa", 70.0] for label in labels.values]
    return Rates(evaluation, index_of(*rows), SETTINGS)


def verdicts(healthy, alarms, nodules, found):
    """Return so many recordings without a nodule and of 2 mm, of which some are called 2 mm."""
    of_none = [(f"0mm/{n}", 0.0, 2.0 if n < alarms else 0.0) for n in range(healthy)]
    return [*of_none, *((f"2mm/{n}", 2.0, 2.0 if n < found else 0.0) for n in range(nodules))]


def test_predictive_values_are_those_of_a_thousand_places():
    # 100 of 1000 places hold a nodule: 80 are found; of the 900 others, 45 are called one.
    both = predictive_values(0.8, 0.95, 0.1)
    assert both == pytest.approx((80 / (80 + 45), 855 / (855 + 20)))
    assert predictive_values(0.0, 1.0, 0.1) == (pytest.approx(UNKNOWN, nan_ok=True), 0.9)


def test_a_measured_specificity_gives_counts_of_false_alarms_and_the_meaning_of_its_table():
    rates = rates_of(evaluated(verdicts(20, 3, 10, 8), detectors=("diagonal", "template")))
    assert set(rates.verdicts(*OF_RULE)["detector"]) == {"template"}
    assert rates.verdicts("template", "held_out").empty
    answers = answers_of(rates, *OF_RULE)
    # Of 3 mm, nothing was judged.
    assert list(answers.found) == [2.0]
    assert answers.found[2.0].value == pytest.approx(0.8)
    alarms = false_alarms(answers.specificity)
    assert (alarms.hits, alarms.of) == (3, 20)
    assert alarms.value == pytest.approx(3 / 20)
    assert alarms.low < alarms.value < alarms.high
    assert answers.set_specificity is None
    expected = predictive_values(0.8, 17 / 20, 0.1)
    assert [each.value for each in answers.meaning] == pytest.approx(expected)
    assert [(each.hits, each.of) for each in answers.meaning] == [(0, 0)] * 2
    # One that detects nothing, or everything, still says how often that is right.
    for called, expected in ((0, (UNKNOWN, 0.9)), (1, (0.1, UNKNOWN))):
        same = evaluated(verdicts(20, 20 * called, 10, 10 * called))
        meaning = answers_of(rates_of(same), *OF_RULE).meaning
        assert [each.value for each in meaning] == pytest.approx(expected, nan_ok=True)
    # Chosen as the best of two, its intervals are those of 97.5 %.
    chosen = answers_of(rates, *OF_RULE, Lead("template", False, 0.8, 2))
    alarms = false_alarms(chosen.specificity)
    assert (alarms.low, alarms.high) == pytest.approx(rate(3, 20, 0.975)[1:])


def test_where_the_threshold_sets_the_specificity_the_meaning_follows_from_the_set_one():
    rates = rates_of(evaluated(verdicts(20, 3, 10, 8), detectors=("diagonal",)))
    answers = answers_of(rates, "diagonal", "leave_one_out")
    quiet = told.set_specificity(rates, "leave_one_out")
    assert (quiet.places, quiet.least_places, quiet.mean) == (20, 19, 0.95)
    few = rates_of(evaluated(verdicts(4, 0, 3, 3), detectors=("diagonal",)))
    few = told.set_specificity(few, "leave_one_out")
    # Fewer healthy places set what their highest score has on average.
    assert few.cannot() and not quiet.cannot() and few.mean == pytest.approx(4 / 5)
    meaning, recall = answers.meaning, answers.found[2.0]
    assert [each.value for each in meaning] == pytest.approx(predictive_values(0.8, 0.95, 0.1))
    for end in ("low", "high"):
        with_both = predictive_values(getattr(recall, end), getattr(quiet, end), 0.1)
        assert [getattr(each, end) for each in meaning] == pytest.approx(with_both)


@pytest.mark.parametrize(
    ("healthy", "alarms", "nodules", "found", "reason"),
    [
        (20, 0, 20, 20, ""),
        (20, 5, 20, 20, "the lower bound of the specificity is 56.8 %"),
        (0, 0, 20, 20, "the lower bound of the specificity is missing"),
        (20, 0, 9, 9, "9 recordings of a size; it takes 16, all found"),
        (20, 0, 20, 15, "the lower bound of the sensitivity of the largest size is lower"),
    ],
)
def test_the_page_says_why_no_size_is_reliably_found(healthy, alarms, nodules, found, reason):
    rates = rates_of(evaluated(verdicts(healthy, alarms, nodules, found)))
    assert answers_of(rates, *OF_RULE).not_reliable(0.85) == reason


def test_a_bound_at_the_level_is_reliable_and_so_many_recordings_all_right_show_it():
    found = {size_mm: Estimate(1.0, 0.8, 1.0, 9, 9, 0.85) for size_mm in (2.0, 3.0)}
    assert told.smallest_reliable_size(found, 0.85, 0.85) == 2.0
    needed, z = told.recordings_to_show(0.85), 1.6448536269514722
    assert needed / (needed + z**2) >= 0.85 > (needed - 1) / (needed - 1 + z**2)


def test_a_share_in_100_reaches_neither_end_by_rounding():
    shown = {0.015: "2", 0.985: "98.5", 0.99999: "> 99.9", 1.0: "100", 0.5049: "50"}
    for share, text in shown.items():
        assert Estimate(share, 0.0, 0.004).in_hundred() == (text, "0 to 0.4")


@pytest.mark.parametrize(
    ("low", "high", "advice"),
    [
        (0.01, 0.2, "more recordings are likely to help"),
        (0.0, 0.2, "this can be chance; too few recordings to tell"),
        (-0.2, 0.05, "this can be chance; too few recordings to tell"),
        (-0.2, 0.04, "more recordings are not likely to help"),
    ],
)
def test_the_gain_since_half_of_the_recordings_gives_the_advice(low, high, advice):
    half = {"share": 0.5, "rate": 0.6, "gain": 0.1, "gain_low": low, "gain_high": high}
    last = {"share": 1.0, "rate": 0.7, "gain": UNKNOWN}
    rows = [
        {"detector": "diagonal", "size_from_mm": first, "size_to_mm": end} | point
        for first, end in ((0.0, 0.0), (1.0, 1.0), (2.0, 5.0), (2.0, 2.0), (5.0, 5.0))
        for point in (half, last)
    ]
    said = told.learning_sentence(pd.DataFrame(rows), "diagonal")
    shown = "specificity 60 % and 70 %, found at 1 mm 60 % and 70 %, found from 2 mm on 60 % and 70"
    assert said.endswith(f"{shown} %: {advice}.")
    assert told.learning_sentence(pd.DataFrame(rows), "taught") == ""


# Kills: the recordings at hand added to those that are needed, and a size that needs none.
def test_what_is_missing_for_a_narrow_interval_is_what_is_needed_without_what_is_there():
    rates = rates_of(evaluated(verdicts(400, 20, 10, 8)))
    more = recordings_needed(0.8, 0.1, 0.95) - 10
    assert f"needs more recordings: {more} of 2 mm." in told.needed_sentence(rates, "template")
    rates = rates_of(evaluated(verdicts(400, 20, 400, 320)))
    assert "or a narrower one" in told.needed_sentence(rates, "template")
