import pytest

from capsule.naming import Entry, classify, folder_size_mm, size_label, size_mm


@pytest.mark.parametrize(
    ("folder", "size"), [("0mm", 0), ("3mm", 3), ("2.5mm", 2.5), ("10mm", 10), ("unlabelled", None)]
)
def test_the_folder_is_the_label(folder, size):
    assert folder_size_mm(folder) == size
    assert size_mm(f"{folder}/r01") == size
    if size is not None:
        assert size_label(size) == folder


@pytest.mark.parametrize("folder", ["mm", "3 mm", "3cm", "-3mm", "3,5mm", "3.mm", "nanmm", "²mm"])
def test_other_folders_name_no_size(folder):
    assert folder_size_mm(folder) is None


def test_recordings_are_ordered_by_size_then_by_number():
    names = ["unlabelled/a", "10mm/r1", "3mm/r10", "3mm/r9", "2.5mm/r1"]
    archive = classify(Entry(f"{name}.csv") for name in names)
    expected = ("2.5mm/r1", "3mm/r9", "3mm/r10", "10mm/r1", "unlabelled/a")
    assert archive.recordings == expected
    assert archive.of_nodules() == ["2.5mm/r1", "3mm/r9", "3mm/r10", "10mm/r1"]
    assert archive.unlabelled() == ["unlabelled/a"]


@pytest.mark.parametrize(
    ("entry", "reason"),
    [
        (Entry("3mm/x.csv", is_file=False), "a folder, not a file"),
        (Entry("3mm/x.csv", is_file=False, is_link=True), "leads nowhere"),
        (Entry("3mm/run 1.csv"), "rename the file"),
        (Entry("3mm/$(x).csv"), "rename the file"),
        (Entry("3mm/a\nb.csv"), "rename the file"),
        (Entry("3mm/-r.csv"), "rename the file"),
        (Entry("3mm/é.csv"), "rename the file"),
        (Entry("3mm/{x}.csv"), "rename the file"),
    ],
)
def test_what_claims_to_be_a_recording_is_refused_by_name(entry, reason):
    archive = classify([entry])
    assert archive.recordings == ()
    assert reason in archive.refused[entry.path]


@pytest.mark.parametrize(
    ("entry", "path", "reason"),
    [
        (Entry("3mm/._r07.csv"), "3mm/._r07.csv", "hidden"),
        (Entry("3mm/notes.txt"), "3mm/notes.txt", "not a .csv file"),
        (Entry("3mm/r07.csv.part"), "3mm/r07.csv.part", "still being recorded"),
        (Entry("r07.csv"), "r07.csv", "lies beside the folders"),
        (Entry("3cm", is_file=False), "3cm/", "names no size"),
    ],
)
def test_what_is_no_recording_is_passed_over_by_name(entry, path, reason):
    archive = classify([entry])
    assert archive.refused == {}
    assert reason in archive.passed_over[path]


def test_what_lies_in_a_folder_that_names_no_size_is_named_once():
    archive = classify([Entry("3cm", is_file=False), Entry("3cm/r01.csv"), Entry(".git")])
    assert list(archive.passed_over) == ["3cm/"]
