"""The five verdicts: which one a score, a threshold, a probability and a reason make."""

import pytest

from capsule.detectors.verdicts import row_verdict, verdict_word

NAN = float("nan")


@pytest.mark.parametrize(
    ("score", "threshold", "probability", "others", "word"),
    [
        (2.0, 1.0, 0.5, {}, "nodule"),
        (2.0, 1.0, 0.49, {}, "uncertain: pass again"),
        (2.0, 1.0, NAN, {}, "nodule"),
        (1.0, 1.0, 0.9, {}, "no nodule"),
        (9.0, 1.0, 0.9, {"unlike": True}, "unlike the recordings that teach"),
        (0.0, 1.0, 0.1, {"unlike": True}, "unlike the recordings that teach"),
        (9.0, 1.0, 0.9, {"unlike": True, "reason": "no wave"}, "no verdict"),
        (NAN, 1.0, NAN, {}, "no verdict"),
        (2.0, None, None, {}, "no verdict"),
    ],
)
def test_a_verdict_is_one_of_five(score, threshold, probability, others, word):
    assert verdict_word(score, threshold, probability, **others) == word
    # A row of a table says the same; an empty cell of a reason is NaN.
    row = {"score": score, "threshold": threshold, "probability": probability}
    row |= {"familiar": "no" if others.get("unlike") else "yes"}
    assert row_verdict(row | {"no_verdict": others.get("reason", NAN)}) == word
    # A place that was passed several times has no probability.
    assert row_verdict({"score": 2.0, "threshold": 1.0}) == "nodule"
