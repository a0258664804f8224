"""How far to trust a verdict, from the archive's own rates."""

import pandas as pd

from capsule.page.answers import answers_of
from capsule.page.patients import together_values
from support.evaluated import RULES, UNKNOWN, evaluated, rates_of
from support.sections import trust

SIZES_MM = (0.0, 1.0, 2.0, 4.0, 5.0)
SAME_BENCH = "These rates hold for recordings of the same bench and capsule only."


def words_of(*pairs, detector="template", scheme="leave_one_out"):
    verdicts = [(f"{size}mm/{n}", float(size), found) for n, (size, found) in enumerate(pairs)]
    rates = rates_of(evaluated(verdicts, SIZES_MM, (detector,), scheme))
    return trust(answers_of(rates, detector, scheme)).removesuffix(f" {SAME_BENCH}")


SINGLE_PASSES = [*[(0, 0.0)] * 19, (0, 2.0), *[(1, 0.0)] * 9, *[(1, 2.0)] * 11, *[(5, 4.0)] * 20]


def test_sensitivity_and_specificity_stand_with_their_intervals():
    assert words_of(*SINGLE_PASSES) == (
        "On this archive, by leave-one-out, judging single passes, it found 31 of 40 nodules of 1 "
        "to 5 mm (77.5 %, 62.5 to 87.7 %; of 1 mm: 11 of 20) and it reported none in 19 of 20 "
        "recordings without a nodule (specificity 95 %, 76.4 to 99.1 %)."
    )


def test_a_specificity_that_the_threshold_sets_is_not_told_as_evidence():
    text = words_of(*SINGLE_PASSES, detector="diagonal")
    assert "it reported none" not in text
    assert "Its specificity is set to 95 % by the threshold, not measured." in text
    assert "New places of this bench may expect a specificity of 86.1 to 99.7 %" in text
    # The law behind the range holds for places like those that teach, and not for other patients.
    assert "Of a new patient, only held-out set-ups tell." in text
    measured = words_of(*SINGLE_PASSES, detector="diagonal", scheme="held_out")
    assert measured.startswith("On held-out sessions, judging single passes, it found 31 of 40")
    assert "it reported none in 19 of 20" in measured and "set to" not in measured


def test_what_the_archive_lacks_is_not_said():
    of_nodules = words_of((2, 2.0), (2, UNKNOWN))
    # Without a verdict a nodule is not found.
    assert "1 of 2 nodules of 2 mm (50 %" in of_nodules and "specificity" not in of_nodules
    healthy = words_of((0, 0.0))
    assert "nodules of" not in healthy and "1 of 1 recordings without a nodule" in healthy
    assert words_of((2, UNKNOWN)).startswith("This archive cannot show how far to trust a verdict")


def test_rates_of_simulated_recordings_are_called_so():
    assert said_of(1, origin="simulated").endswith("these rates do not hold for a real capsule.")
    assert "Some of" in said_of(1, origin="mixed")
    assert said_of(1) == SAME_BENCH


def retest(detector="template", scheme="leave_one_out"):
    key = {"detector": detector, "scheme": scheme, "detected_low": 0.0, "detected_high": 1.0}
    rows = [(3, 0.0, 10, 0.1), (3, 2.0, 6, 1.0), (3, 4.0, 4, 0.5), (1, 2.0, 6, 0.5)]
    columns = ("passes", "size_mm", "sites", "detected")
    return pd.DataFrame([key | dict(zip(columns, row, strict=True)) for row in rows])


def said_of(*rows, table=None, schemes=("leave_one_out",), origin="recorded"):
    listed = [{"site": passes > 1, "passes": passes} for passes in rows]
    table = retest() if table is None else table
    together = together_values(listed, table, schemes, RULES["confidence"])
    nothing = answers_of(rates_of(evaluated([])), "template", "leave_one_out")
    return trust(nothing, single=False, together=together, origin=origin)


def test_rates_of_single_passes_stand_beside_single_passes_only():
    assert said_of(1, 1) == SAME_BENCH
    together = (
        "Judging 3 passes over a place together, by leave-one-out, it found 8 of 10 places with a "
        "nodule of 2 to 4 mm (80 %, 49 to 94.3 %) and reported a nodule at 1 of 10 healthy places "
        "(10 %, 1.8 to 40.4 %)."
    )
    assert said_of(3) == f"{together} {SAME_BENCH}"
    assert said_of(1, 3, 3) == f"{together} {SAME_BENCH}"


def test_of_passes_that_no_labelled_place_has_nothing_is_claimed():
    assert said_of(4) == (
        "This archive has no rate for 4 passes judged together, so it cannot show how far to trust "
        f"such a verdict. {SAME_BENCH}"
    )
    assert "no rate for 3 passes" in said_of(3, table=pd.DataFrame(columns=retest().columns))


def test_a_learned_threshold_sets_the_specificity_of_several_passes_too():
    text = said_of(3, table=retest("diagonal"))
    assert "healthy places" not in text
    assert "The specificity is set to 95 % here too, and not measured." in text
    held_out = said_of(3, table=retest("diagonal", "held_out"), schemes=("held_out",))
    assert "by held-out sessions, it found" in held_out and "1 of 10 healthy places" in held_out
