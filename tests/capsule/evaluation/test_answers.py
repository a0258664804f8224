"""What the report answers first, worked out by counting."""

import math
from itertools import product

import numpy as np
import pandas as pd
import pytest

from capsule.evaluation import answers as told
from capsule.evaluation import archive_rates as told_of
from capsule.evaluation.answers import Estimate, answers_of, false_alarms, predictive_values
from capsule.evaluation.archive_rates import Lead, Rates, headline_confidence, leading
from capsule.evaluation.intervals import rate, recordings_needed
from capsule.evaluation.measures import measure_tables
from capsule.evaluation.paper import Evaluation
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
    counts = (0.0, healthy, alarms), (2.0, nodules, found)
    return [(f"{s:g}mm/{n}", s, 2.0 * (n < hits)) for s, of, hits in counts for n in range(of)]


def test_predictive_values_are_those_of_a_thousand_places():
    # 100 of 1000 places hold a nodule: 80 are found; of the 900 others, 45 are called one.
    both = predictive_values(0.8, 0.95, 0.1)
    assert both == pytest.approx((80 / (80 + 45), 855 / (855 + 20)))
    assert predictive_values(0.0, 1.0, 0.1) == (pytest.approx(UNKNOWN, nan_ok=True), 0.9)


def test_a_measured_specificity_gives_counts_of_false_alarms_and_the_meaning_of_its_table():
    rates = rates_of(evaluated(verdicts(20, 3, 10, 8), detectors=("diagonal", "template")))
    assert rates.verdicts("template", "held_out").empty
    # Chosen as the best of two, its intervals are those of 97.5 %.
    for lead, level in ((None, 0.95), (Lead("template", False, 0.8, 2), 0.975)):
        answers = answers_of(rates, *OF_RULE, lead)
        # Of 3 mm, nothing was judged.
        assert list(answers.found) == [2.0] and answers.set_specificity is None
        assert answers.found[2.0].value == pytest.approx(0.8)
        alarms = false_alarms(answers.specificity)
        assert (alarms.hits, alarms.of) == (3, 20)
        assert (alarms.value, alarms.low, alarms.high) == pytest.approx(rate(3, 20, level))
    # One that detects nothing, or everything, still says how often that is right.
    measured = 3, 8, predictive_values(0.8, 17 / 20, 0.1)
    for alarms, hits, expected in (measured, (0, 0, (UNKNOWN, 0.9)), (20, 10, (0.1, UNKNOWN))):
        meaning = answers_of(rates_of(evaluated(verdicts(20, alarms, 10, hits))), *OF_RULE).meaning
        assert [each.value for each in meaning] == pytest.approx(expected, nan_ok=True)
        assert [(each.hits, each.of) for each in meaning] == [(0, 0)] * 2


def test_where_the_threshold_sets_the_specificity_the_meaning_follows_from_the_set_one():
    rates = rates_of(evaluated(verdicts(20, 3, 10, 8), detectors=("diagonal",)))
    answers = answers_of(rates, "diagonal", "leave_one_out")
    quiet, recall = answers.set_specificity, answers.found[2.0]
    assert (quiet.places, quiet.least_places, quiet.mean) == (20, 19, 0.95)
    few = told.set_specificity(rates_of(evaluated(verdicts(4, 0, 3, 3))), "leave_one_out")
    # Fewer healthy places set what their highest score has on average.
    assert few.cannot() and not quiet.cannot() and few.mean == pytest.approx(4 / 5)
    for name in ("value", "low", "high"):
        specificity = 0.95 if name == "value" else getattr(quiet, name)
        with_both = predictive_values(getattr(recall, name), specificity, 0.1)
        assert [getattr(each, name) for each in answers.meaning] == pytest.approx(with_both)


def test_the_page_says_why_no_size_is_reliably_found():
    for *counts, reason in (
        (20, 0, 20, 20, ""),
        (20, 5, 20, 20, "the lower bound of the specificity is 56.8 %"),
        (0, 0, 20, 20, "the lower bound of the specificity is missing"),
        (20, 0, 9, 9, "9 recordings of a size; it takes 16, all found"),
        (20, 0, 20, 15, "the lower bound of the sensitivity of the largest size is lower"),
    ):
        rates = rates_of(evaluated(verdicts(*counts)))
        assert answers_of(rates, *OF_RULE).not_reliable(0.85) == reason
    # A bound at the level is reliable, and so many recordings, all right, show it.
    found = {size_mm: Estimate(1.0, 0.8, 1.0, 9, 9, 0.85) for size_mm in (2.0, 3.0)}
    assert told.smallest_reliable_size(found, 0.85, 0.85) == 2.0
    needed, z = told.recordings_to_show(0.85), 1.6448536269514722
    assert needed / (needed + z**2) >= 0.85 > (needed - 1) / (needed - 1 + z**2)


def test_a_share_in_100_reaches_neither_end_by_rounding():
    shown = {0.015: "2", 0.985: "98.5", 0.99999: "> 99.9", 1.0: "100", 0.5049: "50"}
    for share, text in shown.items():
        assert Estimate(share, 0.0, 0.004).in_hundred() == (text, "0 to 0.4")


def test_the_gain_since_half_of_the_recordings_gives_the_advice():
    ends = {"size_from_mm": [0.0, 1.0, 2.0, 2.0, 5.0], "size_to_mm": [0.0, 1.0, 5.0, 2.0, 5.0]}
    shown = "specificity 60 % and 70 %, found at 1 mm 60 % and 70 %, found from 2 mm on 60 % and 70"
    for low, high, advice in (
        (0.01, 0.2, "more recordings are likely to help"),
        (0.0, 0.05, "this can be chance; too few recordings to tell"),
        (-0.2, 0.04, "more recordings are not likely to help"),
    ):
        gain = {"gain": 0.1, "gain_low": low, "gain_high": high}
        half = pd.DataFrame(ends).assign(detector="diagonal", share=0.5, rate=0.6, **gain)
        rows = pd.concat([half, half.assign(share=1.0, rate=0.7, gain=UNKNOWN)])
        assert told.learning_sentence(rows, "diagonal").endswith(f"{shown} %: {advice}.")
        assert told.learning_sentence(rows, "taught") == ""


# Kills: the recordings at hand added to those that are needed, and a size that needs none.
def test_what_is_missing_for_a_narrow_interval_is_what_is_needed_without_what_is_there():
    rates = rates_of(evaluated(verdicts(400, 20, 10, 8)))
    more = recordings_needed(0.8, 0.1, 0.95) - 10
    assert f"needs more recordings: {more} of 2 mm." in told.needed_sentence(rates, "template")
    rates = rates_of(evaluated(verdicts(400, 20, 400, 320)))
    assert "or a narrower one" in told.needed_sentence(rates, "template")


# The scheme and the detector that are shown first, and for which recordings rates hold.


def rates_by(shown, table=None):
    evaluation = Evaluation(pd.DataFrame({"scheme": shown}, dtype=str), {}, {})
    settings = {"evaluation": {"schemes": ["leave_one_out"], "held_out": ["late"]}}
    return Rates(evaluation, table, settings)


def test_what_was_held_out_is_shown_first_and_no_learned_threshold_sets_its_specificity():
    judged = ["resubstitution", "leave_one_session_out", "leave_one_out", "held_out"]
    assert rates_by(judged).schemes == [*judged[:1:-1], *judged[:2]]
    assert rates_by([]).schemes == ["leave_one_out"]
    every = product(["template", "diagonal", "taught", "always_nodule"], judged)
    found = {each for each in every if told_of.sets_specificity(*each)}
    assert found == set(product(["diagonal", "taught"], judged[::2]))


def setups_of(setups, size_mm=0.0, session="late"):
    names = [f"{size_mm:g}mm/r{n}" for n in range(len(setups))]
    columns = {"recording": names, "setup": [*setups], "status": "accepted"}
    return pd.DataFrame({**columns, "size_mm": size_mm, "session": session})


def test_rates_hold_over_new_set_ups_only_if_three_that_taught_nothing_were_judged():
    for judged, teaching, scheme, new in (
        ("abcc", "d", "held_out", True),
        ("abb", "d", "held_out", False),
        # A set-up that also teaches is no new one.
        ("abc", "c", "held_out", False),
        (["a", "b", None], "d", "held_out", False),
        # Leaving out one place leaves its set-up to teach.
        ("abc", "abc", "leave_one_out", False),
        ("abc", "abc", "leave_one_setup_out", True),
        ("ab", "ab", "leave_one_setup_out", False),
        ("", "", "held_out", False),
    ):
        scope = told_of.scope_of(setups_of(judged), setups_of(teaching), scheme)
        expected = "over new set-ups (3 were" if new else "for further runs of these set-ups"
        assert scope.new is new and scope.text().startswith(expected)
    # Each table says for what the rates of its schemes hold.
    teaching = [setups_of("xy", session="early"), setups_of("xy", 0.5, "early")]
    table = pd.concat([setups_of("abc"), setups_of("abc", 0.5), *teaching])
    said = told_of.table_note(rates_by(["held_out", "leave_one_out", "resubstitution"], table))
    assert said.startswith("Held-out sessions: rates over new set-ups. Leave-one-out: rates for")
    # Healthy set-ups alone do not make a class of nodules.
    few = pd.concat([setups_of("abc"), setups_of("ab", 2.0), *teaching])
    assert told_of.table_note(rates_by(["held_out"], few)).endswith("of these set-ups.")


OF_ARCHIVE = {"tolerance_mm": 1.0, "confidence": 0.95, "specificity": 0.75, "prevalence": 0.1}
SCHEMES = ["leave_one_out", "resubstitution"]


def summary(**by_detector):
    """Return the summary of scores above a threshold of 1, of four healthy recordings and of 1 mm.

    The thresholds let a quarter of the healthy recordings pass, and that of `template` all.
    """
    scores = pd.DataFrame(by_detector, dtype=float).assign(size_mm=[0.0] * 4 + [1.0] * 4)
    table = scores.melt("size_mm", var_name="detector", value_name="score").assign(threshold=1.0)
    table["predicted_mm"] = (2.0 * (table["score"] > 1)).where(table["score"].notna())
    table = pd.concat([table.assign(scheme=scheme) for scheme in SCHEMES])
    return measure_tables(table, [0.0, 1.0, 2.0], OF_ARCHIVE, names=["summary"])["summary"]


# By balanced accuracy `template` would lead, whose threshold of 1 raises no false alarm here.
SCORES = {
    "template": [0, 0, 0.9, 0.8, 2, 2, 0.5, 0.5],
    "diagonal": [0, 0, 2, 0.8, 2, 2, 1.5, 0.5],
    "taught": [0, 0, 0.9, 2, 1.5, 0.5, 3, 1.2],
}
OF_TAUGHT = np.array(SCORES["taught"])
TEMPLATE, NAN = {"template": SCORES["template"]}, UNKNOWN


def test_detectors_are_compared_at_the_same_specificity():
    for scores, named, detector, sensitivity in (
        # The one that finds most at the same specificity leads, unless another is named.
        (SCORES, "best", "diagonal", 0.75),
        (dict(reversed(SCORES.items())), "best", "taught", 0.75),
        (SCORES, "template", "template", 0.5),
        # Its own threshold, which then finds all or nothing, does not choose.
        (TEMPLATE | {"taught": OF_TAUGHT + 5}, "best", "taught", 0.75),
        (TEMPLATE | {"taught": OF_TAUGHT - 5}, "best", "taught", 0.75),
        # No verdict counts as a false alarm, or as a missed nodule.
        (TEMPLATE | {"taught": [0, 0, NAN, 0.5, 2, 2, NAN, 0.2]}, "taught", "taught", 0.5),
        ({"taught": [NAN, NAN, 0, 0.5, 2, 2, 2, 2]}, "best", "taught", 0.0),
        # Where nothing can be compared, the first leads.
        ({"diagonal": [NAN] * 8, "template": [NAN] * 8}, "best", "diagonal", NAN),
    ):
        lead = leading(summary(**scores), list(scores), SCHEMES, named)
        assert (lead.detector, lead.named) == (detector, named != "best")
        assert lead.sensitivity == pytest.approx(sensitivity, nan_ok=True)
        assert lead.compared == (0 if math.isnan(sensitivity) else len(scores))


def test_scores_are_compared_with_the_threshold_of_their_fold_and_held_out_ones_never_choose():
    # Half of the folds add 10 to score and threshold alike, as an adapted network may.
    added, sizes_mm = np.tile([0.0, 10.0], 4), np.repeat([0.0, 2.0], 4)
    made = {"size_mm": sizes_mm, "predicted_mm": sizes_mm, "score": added + sizes_mm}
    made = pd.DataFrame(made | {"threshold": added + 1, "detector": "one", "scheme": SCHEMES[0]})
    made = measure_tables(made, [0.0, 2.0], OF_ARCHIVE, names=["summary"])["summary"]
    assert made["sensitivity_at_specificity"][0] == 1.0
    table = summary(**SCORES)
    apart = table[table["scheme"] == "leave_one_out"].assign(scheme="held_out")
    apart["sensitivity_at_specificity"] = (apart["detector"] == "template").astype(float)
    both = pd.concat([apart, table])
    assert leading(both, list(SCORES), ["held_out", *SCHEMES], "best").detector == "diagonal"
    # The choice of the best is paid for where it was made.
    chosen = (False, "leave_one_out", 4, 0.9875), (False, "held_out", 4, 0.95)
    given = (True, "leave_one_out", 4, 0.95), (False, "leave_one_out", 0, 0.95)
    for named, scheme, compared, level in chosen + given:
        lead = Lead("diagonal", named, 0.7, compared)
        assert headline_confidence(lead, scheme, 0.95) == pytest.approx(level)
