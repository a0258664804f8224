"""Tests of the sentence on how far to trust a verdict, from the archive's own rates."""

import pandas as pd

from capsule.page.trust import trust_words

UNKNOWN = float("nan")


def verdicts(*pairs):
    return pd.DataFrame(pairs, columns=["size_mm", "predicted_mm"], dtype=float)


def test_sensitivity_and_specificity_stand_with_their_intervals():
    table = verdicts(*[(0, 0)] * 19, (0, 2), *[(1, 0)] * 9, *[(1, 2)] * 11, *[(5, 4)] * 20)
    assert trust_words(table, "leave_one_out", 0.95, "recorded") == (
        "On this archive, by leave-one-out, it found 31 of 40 nodules of 1 to 5 mm (77.5 %, "
        "62.5 to 87.7 %; of 1 mm: 11 of 20) and it reported none in 19 of 20 recordings without a "
        "nodule (specificity 95 %, 76.4 to 99.1 %). These rates hold for recordings of the same "
        "bench and capsule only."
    )


def test_what_the_archive_lacks_is_not_said():
    of_nodules = trust_words(verdicts((2, 2), (2, UNKNOWN)), "leave_one_out", 0.95, "recorded")
    assert "1 of 1 nodules of 2 mm (100 %" in of_nodules and "specificity" not in of_nodules
    healthy = trust_words(verdicts((0, 0)), "leave_one_out", 0.95, "recorded")
    assert "nodules of" not in healthy and "1 of 1 recordings without a nodule" in healthy
    assert trust_words(verdicts((2, UNKNOWN)), "leave_one_out", 0.95, "recorded").startswith(
        "This archive cannot show how far to trust a verdict"
    )


def test_rates_of_simulated_recordings_are_called_so():
    text = trust_words(verdicts((2, 2), (0, 0)), "leave_one_out", 0.95, "simulated")
    assert text.endswith("these rates do not hold for a real capsule.")
    assert "Some of" in trust_words(verdicts((2, 2)), "leave_one_out", 0.95, "mixed")
