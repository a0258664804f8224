"""The list of recordings: which of several with the same readings counts."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from capsule.listing import list_rows, reasons_of_copies
from capsule.names import Entry, classify

CONTRADICTION = "under another size: one of the two is mislabelled"


def checks(**readings):
    """Make the checks of accepted recordings; written r01_at_3mm, with their readings."""
    names = {"/".join(reversed(key.split("_at_"))): value for key, value in readings.items()}
    return {name: {"status": "accepted", "readings_sha256": value} for name, value in names.items()}


def test_under_two_sizes_none_counts():
    made = checks(r01_at_3mm="x", r01_at_4mm="x", r02_at_3mm="y")
    assert reasons_of_copies(made) == {
        "3mm/r01": f"the same content as 4mm/r01, {CONTRADICTION}",
        "4mm/r01": f"the same content as 3mm/r01, {CONTRADICTION}",
    }


def test_a_copy_does_not_save_a_contradiction():
    made = checks(r01_at_0mm="x", r02_at_0mm="x", r01_at_4mm="x", patient_at_unlabelled="x")
    reasons = reasons_of_copies(made)
    assert set(reasons) == {"0mm/r01", "0mm/r02", "4mm/r01"}
    assert all(reason.endswith(CONTRADICTION) for reason in reasons.values())


def test_the_same_size_written_in_another_way_is_no_contradiction():
    made = {
        f"{folder}/r01": {"status": "accepted", "readings_sha256": "x"}
        for folder in ("3mm", "3.0mm")
    }
    assert reasons_of_copies(made) == {"3.0mm/r01": "the same content as 3mm/r01"}


@pytest.mark.parametrize("copy", ["a-copy-of-r01", "0r01", "r01-copy", "r01.1", "R01+"])
def test_the_original_keeps_its_place_whatever_the_copy_sorts_before(copy):
    made = {f"3mm/{name}": {"status": "accepted", "readings_sha256": "x"} for name in (copy, "r01")}
    assert reasons_of_copies(made) == {f"3mm/{copy}": "the same content as 3mm/r01"}


def test_a_label_counts_more_than_a_short_name():
    made = checks(a_at_unlabelled="x", longer_at_3mm="x")
    assert reasons_of_copies(made) == {"unlabelled/a": "the same content as 3mm/longer"}


names = st.builds(
    "{}/{}".format, st.sampled_from(["0mm", "3mm", "unlabelled"]), st.text("ab1", min_size=1)
)


@given(st.dictionaries(names, st.sampled_from("xyz"), max_size=8), st.randoms())
def test_of_equal_readings_at_most_one_counts_whatever_the_order(readings, shuffler):
    made = {
        name: {"status": "accepted", "readings_sha256": each} for name, each in readings.items()
    }
    shuffled = list(made.items())
    shuffler.shuffle(shuffled)
    reasons = reasons_of_copies(made)
    assert reasons_of_copies(dict(shuffled)) == reasons
    kept = [readings[name] for name in made if name not in reasons]
    assert len(kept) == len(set(kept))


def test_a_row_says_why():
    made = checks(r01_at_3mm="x", old_r01_at_3mm="x")
    for name, check in made.items():
        check |= {"recording": name, "size_mm": 3.0, "header": {}, "samples": 1, "duration_s": 0.0}
        check |= {"reason": "", "no_verdict": "", "sha256": "0"}
    archive = classify([Entry("3mm/r01.csv"), Entry("3mm/old_r01.csv")])
    status = {row["recording"]: row["status"] for row in list_rows(archive, made)}
    assert status == {"3mm/r01": "accepted", "3mm/old_r01": "rejected"}
