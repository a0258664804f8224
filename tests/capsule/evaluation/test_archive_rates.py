"""The scheme that the page shows first, and for which recordings its rates hold."""

import pandas as pd
import pytest

from capsule.evaluation import archive_rates as rates
from capsule.evaluation.paper import Evaluation


def predictions(*names):
    return pd.DataFrame({"scheme": names}, dtype=str)


def rates_by(shown, table=None, configured=()):
    evaluation = Evaluation(predictions(*shown), {}, {})
    settings = {"evaluation": {"schemes": configured, "held_out": ["late"]}}
    return rates.Rates(evaluation, table, settings)


def test_what_was_held_out_is_shown_first_and_then_leaving_one_place_out():
    judged = ("resubstitution", "leave_one_session_out", "leave_one_out", "held_out")
    assert rates_by(judged).schemes == [*judged[:1:-1], *judged[:2]]
    assert rates_by(["resubstitution"]).schemes == ["resubstitution"]
    assert rates_by([], configured=["leave_one_out"]).schemes == ["leave_one_out"]


@pytest.mark.parametrize(
    ("detector", "scheme", "expected"),
    [
        ("diagonal", "leave_one_out", True),
        ("taught", "resubstitution", True),
        ("diagonal", "held_out", False),
        ("diagonal", "leave_one_session_out", False),
        ("template", "leave_one_out", False),
        ("always_nodule", "leave_one_out", False),
    ],
)
def test_a_learned_threshold_sets_the_specificity_unless_a_group_is_held_out(
    detector, scheme, expected
):
    assert rates.sets_specificity(detector, scheme) is expected


def index(setups, size_mm=0.0, session="late"):
    names = [f"{size_mm:g}mm/r{n}" for n in range(len(setups))]
    columns = {"recording": names, "setup": setups, "status": "accepted"}
    return pd.DataFrame({**columns, "size_mm": size_mm, "session": session})


@pytest.mark.parametrize(
    ("judged", "teaching", "scheme", "new"),
    [
        (["a", "b", "c", "c"], ["d"], "held_out", True),
        (["a", "b", "b"], ["d"], "held_out", False),
        # A set-up that also teaches is no new one.
        (["a", "b", "c"], ["c"], "held_out", False),
        (["a", "b", None], ["d"], "held_out", False),
        # Leaving out one place leaves its set-up to teach.
        (["a", "b", "c"], ["a", "b", "c"], "leave_one_out", False),
        (["a", "b", "c"], ["a", "b", "c"], "leave_one_setup_out", True),
        (["a", "b"], ["a", "b"], "leave_one_setup_out", False),
        ([], [], "held_out", False),
    ],
)
def test_rates_hold_over_new_set_ups_only_if_three_that_taught_nothing_were_judged(
    judged, teaching, scheme, new
):
    scope = rates.scope_of(index(judged), index(teaching), scheme)
    assert scope.new is new
    expected = "over new set-ups (3 were" if new else "for further runs of these set-ups"
    assert scope.text().startswith(expected)


def test_each_table_says_for_what_the_rates_of_its_schemes_hold():
    held_out = [index(list("abc")), index(list("abc"), 2.0)]
    teaching = [index(list("xy"), session="early"), index(list("xy"), 2.0, "early")]
    table = pd.concat([*held_out, *teaching])
    of_table = ["held_out", "leave_one_out", "resubstitution"]
    assert rates.table_note(rates_by(of_table, table)) == (
        "Held-out sessions: rates over new set-ups. Leave-one-out: rates for further runs of these "
        "set-ups."
    )
    # Healthy set-ups alone do not make a class of nodules.
    few = pd.concat([held_out[0], index(list("ab"), 2.0), *teaching])
    assert rates.table_note(rates_by(["held_out"], few)).endswith("of these set-ups.")
