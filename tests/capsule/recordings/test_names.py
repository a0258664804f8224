import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from capsule.recordings import names as naming
from capsule.recordings.names import Entry, as_cell, classify, displayed


def test_the_folder_is_the_label():
    assert naming.sizes_of(["3mm/r01", "unlabelled/r01"]) == {"3mm/r01": 3}
    for folder in ("mm", "3 mm", "-3mm", "3,5mm", "3.mm", "nanmm", "²mm", "٣mm", "unlabelled"):
        assert naming.folder_size_mm(folder) is None
    assert naming.size_label(2.5) == "2.5mm"
    for size in (0, 0.001, 2, 10, 999.999):
        assert naming.size_mm(f"{naming.size_label(size)}/r01") == size


def test_recordings_are_ordered_by_size_then_by_number_then_by_letters():
    # Equal numbers keep their text. Names as long, and ends repeated as often, as allowed.
    runs = ["02", "2", "10", "a", "a2", "a2b", "a10", "ab", "r" + "01" * 19, "zy1-_" * 19 + "x"]
    names = ["2.5mm/r1", *(f"3mm/{run}" for run in runs), "10mm/r1", "unlabelled/a"]
    assert classify(Entry(f"{name}.csv") for name in names[::-1]).recordings == tuple(names)


REFUSED = {
    Entry("3mm/x.csv", "folder"): "a folder, not a file",
    Entry("3mm/x.csv", "dead link"): "a link to a file that does not exist",
    Entry("3mm/x.csv", "device"): "a pipe or a device",
    Entry("3mm/x.csv", "link out"): "a link to a place outside raw/",
    Entry("3mm/x.csv", "locked"): "no permission",
    **{
        Entry(f"3mm/{name}.csv"): "rename the file"
        for name in ("run 1", "zy1-_" * 19 + "xx", "$(x)", "a\nb", "-r", "é", "{x}")
    },
    # Snakemake stops at such a name.
    Entry(f"3mm/r{'01' * 20}.csv"): "ends in '01' twenty times",
}
PASSED_OVER = {
    Entry("3mm/._r07.csv"): "hidden",
    Entry("3mm/R07.CSV"): "write the ending in lower case",
    Entry("3mm/monday", "folder"): "a folder; put recordings directly",
    Entry("4mm", "locked"): "no permission",
    Entry("3mm/notes.txt"): "not a .csv file",
    Entry("3mm/r07.csv.part"): "an unfinished recording",
    Entry("r07.csv"): "directly in raw/; move it",
    Entry("3cm", "folder"): "name is not a size",
    Entry(".x.csv"): "hidden file",
    Entry(".5mm/x.csv"): "in a hidden folder; move it",
    Entry("2mm", "link out"): "replace it with a copy of the linked folder",
}


@pytest.mark.parametrize("entry", [*REFUSED, *PASSED_OVER])
def test_what_is_no_usable_recording_is_named_with_the_reason(entry):
    archive = classify([entry])
    told, others = archive.refused, archive.passed_over
    if entry in PASSED_OVER:
        told, others = others, told
    assert not archive.recordings and not others
    (reason,) = told.values()
    assert (REFUSED | PASSED_OVER)[entry] in reason


# Names on a disk, including bytes that are not UTF-8.
NAMES = st.binary(min_size=1, max_size=20).map(lambda name: name.decode("utf-8", "surrogateescape"))


@given(NAMES, NAMES)
def test_every_name_is_processed_or_named_with_a_reason_in_a_line_of_its_own(one, other):
    assert displayed(one).isprintable() and displayed(one).encode("utf-8")
    assert (displayed(one) == displayed(other)) == (one == other)
    archive = classify([Entry(f"3mm/{one}.csv")])
    listed = [f"{recording}.csv" for recording in archive.recordings]
    listed += [*archive.refused, *archive.passed_over]
    assert listed == [displayed(f"3mm/{one}.csv")]
    for recording in archive.recordings:
        assert re.fullmatch(r"[A-Za-z0-9_.+/-]+", recording)


def test_a_cell_is_never_a_formula_nor_more_than_one_line():
    for text, cell in (
        *((text, text) for text in ("bench 2", "-1.5", " =1+1", "a; '=2")),
        *((text, f" {text}") for text in ("=1+1", "\uff1d1+1", "-1.5+cmd|' /C calc'!A0")),
        ("bench;=1+1;'=2", "bench; =1+1; '=2"),
        ('bench;"=1+1"', 'bench; "=1+1"'),
        ("a\tb", "a\\tb"),
        # A backslash is no escape.
        ("a\\n", "a\\\\n"),
    ):
        assert as_cell(text) == cell
