"""The scheme and the detector that the page shows first, and for which recordings rates hold."""

import math
from itertools import product

import numpy as np
import pandas as pd
import pytest

from capsule.evaluation import archive_rates as rates
from capsule.evaluation.archive_rates import Lead, headline_confidence, leading
from capsule.evaluation.measures import measure_tables
from capsule.evaluation.paper import Evaluation


def rates_by(shown, table=None, configured=()):
    evaluation = Evaluation(pd.DataFrame({"scheme": shown}, dtype=str), {}, {})
    settings = {"evaluation": {"schemes": configured, "held_out": ["late"]}}
    return rates.Rates(evaluation, table, settings)


def test_what_was_held_out_is_shown_first_and_then_leaving_one_place_out():
    judged = ("resubstitution", "leave_one_session_out", "leave_one_out", "held_out")
    assert rates_by(judged).schemes == [*judged[:1:-1], *judged[:2]]
    assert rates_by([], configured=["leave_one_out"]).schemes == ["leave_one_out"]


def test_a_learned_threshold_sets_the_specificity_unless_a_group_is_held_out():
    schemes = ["leave_one_out", "resubstitution", "held_out", "leave_one_session_out"]
    every = product(["template", "diagonal", "taught", "always_nodule"], schemes)
    found = {each for each in every if rates.sets_specificity(*each)}
    assert found == set(product(["diagonal", "taught"], schemes[:2]))


def index(setups, size_mm=0.0, session="late"):
    names = [f"{size_mm:g}mm/r{n}" for n in range(len(setups))]
    columns = {"recording": names, "setup": [*setups], "status": "accepted"}
    return pd.DataFrame({**columns, "size_mm": size_mm, "session": session})


@pytest.mark.parametrize(
    ("judged", "teaching", "scheme", "new"),
    [
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
    ],
)
def test_rates_hold_over_three_new_set_ups_that_taught_nothing(judged, teaching, scheme, new):
    scope = rates.scope_of(index(judged), index(teaching), scheme)
    assert scope.new is new
    expected = "over new set-ups (3 were" if new else "for further runs of these set-ups"
    assert scope.text().startswith(expected)


def test_each_table_says_for_what_the_rates_of_its_schemes_hold():
    teaching = [index("xy", session="early"), index("xy", 0.5, "early")]
    table = pd.concat([index("abc"), index("abc", 0.5), *teaching])
    said = rates.table_note(rates_by(["held_out", "leave_one_out", "resubstitution"], table))
    assert said.startswith("Held-out sessions: rates over new set-ups. Leave-one-out: rates for")
    # Healthy set-ups alone do not make a class of nodules.
    few = pd.concat([index("abc"), index("ab", 2.0), *teaching])
    assert rates.table_note(rates_by(["held_out"], few)).endswith("of these set-ups.")


RULES = {"tolerance_mm": 1.0, "confidence": 0.95, "specificity": 0.75, "prevalence": 0.1}
SCHEMES = ["leave_one_out", "resubstitution"]


def summary(**by_detector):
    """Return the summary of scores above a threshold of 1, of four healthy recordings and of 1 mm.

    The thresholds let a quarter of the healthy recordings pass, and that of `template` all.
    """
    columns = ["detector", "scheme", "score", "size_mm", "threshold", "predicted_mm"]
    rows = [
        (detector, scheme, score, true, 1.0, score if np.isnan(score) else 2.0 * (score > 1))
        for detector, scores in by_detector.items()
        for scheme in SCHEMES
        for true, score in zip([0.0] * 4 + [1.0] * 4, scores, strict=True)
    ]
    table = pd.DataFrame(rows, columns=columns)
    return measure_tables(table, [0.0, 1.0, 2.0], RULES, names=["summary"])["summary"]


# By balanced accuracy `template` would lead, whose threshold of 1 raises no false alarm here.
SCORES = {
    "template": [0, 0, 0.9, 0.8, 2, 2, 0.5, 0.5],
    "diagonal": [0, 0, 2, 0.8, 2, 2, 1.5, 0.5],
    "taught": [0, 0, 0.9, 2, 1.5, 0.5, 3, 1.2],
}
TURNED = dict(reversed(SCORES.items()))
OF_TAUGHT = np.array(SCORES["taught"])
TEMPLATE, NAN = {"template": SCORES["template"]}, float("nan")


@pytest.mark.parametrize(
    ("scores", "named", "detector", "sensitivity"),
    [
        # The one that finds most at the same specificity leads, unless another is named.
        (SCORES, "best", "diagonal", 0.75),
        (TURNED, "best", "taught", 0.75),
        (SCORES, "template", "template", 0.5),
        # Its own threshold, which then finds all or nothing, does not choose.
        (TEMPLATE | {"taught": OF_TAUGHT + 5}, "best", "taught", 0.75),
        (TEMPLATE | {"taught": OF_TAUGHT - 5}, "best", "taught", 0.75),
        # No verdict counts as a false alarm, or as a missed nodule.
        (TEMPLATE | {"taught": [0, 0, NAN, 0.5, 2, 2, NAN, 0.2]}, "taught", "taught", 0.5),
        ({"taught": [NAN, NAN, 0, 0.5, 2, 2, 2, 2]}, "best", "taught", 0.0),
        # Where nothing can be compared, the first leads.
        ({"diagonal": [NAN] * 8, "template": [NAN] * 8}, "best", "diagonal", NAN),
    ],
)
def test_detectors_are_compared_at_the_same_specificity(scores, named, detector, sensitivity):
    lead = leading(summary(**scores), list(scores), SCHEMES, named)
    assert (lead.detector, lead.named) == (detector, named != "best")
    assert lead.sensitivity == pytest.approx(sensitivity, nan_ok=True)
    assert lead.compared == (0 if math.isnan(sensitivity) else len(scores))


def test_scores_are_compared_with_the_threshold_of_their_fold_and_held_out_ones_never_choose():
    # Half of the folds add 10 to score and threshold alike, as an adapted network may.
    added, sizes_mm = np.tile([0.0, 10.0], 4), np.repeat([0.0, 2.0], 4)
    made = {"size_mm": sizes_mm, "predicted_mm": sizes_mm, "score": added + sizes_mm}
    made = pd.DataFrame(made | {"threshold": added + 1, "detector": "one", "scheme": SCHEMES[0]})
    made = measure_tables(made, [0.0, 2.0], RULES, names=["summary"])["summary"]
    assert made["sensitivity_at_specificity"][0] == 1.0
    table = summary(**SCORES)
    apart = table[table["scheme"] == "leave_one_out"].assign(scheme="held_out")
    apart["sensitivity_at_specificity"] = (apart["detector"] == "template").astype(float)
    both = pd.concat([apart, table])
    assert leading(both, list(SCORES), ["held_out", *SCHEMES], "best").detector == "diagonal"
    # Without any verdict, the first leads.
    lead = leading(summary(), list(SCORES), SCHEMES, "best")
    assert (lead.detector, lead.compared) == ("template", 0)


def test_the_choice_of_the_best_is_paid_for_where_it_was_made():
    for named, scheme, compared, level in (
        (False, "leave_one_out", 4, 0.9875),
        (True, "leave_one_out", 4, 0.95),
        (False, "held_out", 4, 0.95),
        (False, "leave_one_out", 0, 0.95),
    ):
        lead = Lead("diagonal", named, 0.7, compared)
        assert headline_confidence(lead, scheme, 0.95) == pytest.approx(level)
