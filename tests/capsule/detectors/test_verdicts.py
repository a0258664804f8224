"""The five verdicts: which one a score, a threshold, a probability and a reason make."""

import pytest

from capsule.detectors.verdicts import VerdictWord, row_verdict, verdict_word

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


def test_a_row_of_a_table_says_why_it_is_unlike_and_has_no_verdict():
    row = {"score": 2.0, "threshold": 1.0, "probability": 0.9, "no_verdict": NAN}
    assert row_verdict(row) is VerdictWord.NODULE
    assert row_verdict({**row, "no_verdict": "no wave"}) is VerdictWord.NO_VERDICT
    assert row_verdict({**row, "familiar": "no"}) is VerdictWord.UNLIKE
    # A place passed several times has no probability: its mean score decides.
    assert row_verdict({"score": 2.0, "threshold": 1.0}) is VerdictWord.NODULE
