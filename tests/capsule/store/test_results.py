"""An archive is divided into batches; the files of recordings are written, found and read again."""

import os
import re
import shutil
from unittest.mock import Mock, call

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from capsule.errors import CapsuleError
from capsule.recordings.names import folder_of
from capsule.store import files
from capsule.store import results as store
from capsule.store.results import CHECKS, FITS, MATRICES, SIGNALS, batches, divide, left_over
from support.stored import rows_of
from support.synthetic import write_archive

POOL = [f"{folder}/r-{run}" for folder in ("0mm", "2.5mm", "unlabelled") for run in range(99)]
DRAWN = st.sampled_from(POOL)
ARCHIVES = st.sets(DRAWN, max_size=60).map(sorted)
SIZES = st.integers(1, 9)


def test_the_size_of_a_batch_goes_by_the_size_of_the_archive_or_is_configured():
    sizes = [store.batch_size(count, "auto") for count in (500, 501, 5000, 5001)]
    assert (sizes, store.batch_size(501, 7)) == ([1, 16, 16, 160], 7)


@given(ARCHIVES, SIZES, st.randoms())
def test_each_recording_is_in_one_batch_of_its_folder_whatever_the_order(names, most, shuffler):
    divided = batches(names, most)
    assert sorted(name for members in divided.values() for name in members) == names
    for batch, members in divided.items():
        assert 1 <= len(members) <= most
        assert set(map(folder_of, members)) == {folder_of(batch)}
    shuffled = names.copy()
    shuffler.shuffle(shuffled)
    assert batches(shuffled, most) == divided


@given(ARCHIVES, DRAWN, SIZES)
def test_a_recording_that_comes_or_goes_changes_or_divides_one_batch(names, another, most):
    others = [name for name in names if name != another]
    without, among = batches(others, most), batches([*others, another], most)
    lost = [members for batch, members in without.items() if among.get(batch) != members]
    made = [members for batch, members in among.items() if without.get(batch) != members]
    assert len(lost) <= 1
    before = [name for members in lost for name in members]
    assert sorted(name for members in made for name in members) == sorted([*before, another])


@given(ARCHIVES, SIZES, SIZES)
def test_a_batch_of_a_small_size_lies_within_one_of_a_larger_size(names, one, other):
    small, large = batches(names, min(one, other)), batches(names, max(one, other))
    batch_of = {name: batch for batch, members in large.items() for name in members}
    assert all(len({batch_of[name] for name in members}) == 1 for members in small.values())


def test_a_folder_is_described_whole_until_it_is_large():
    runs = [f"3mm/r{run:03d}" for run in range(store.DESCRIBED_TOGETHER + 1)]
    whole = divide(["0mm/r01", *runs[:-1]], "auto")
    assert whole.alone and whole.described == {"0mm/batch": ["0mm/r01"], "3mm/batch": runs[:-1]}
    assert list(whole.batches) == ["0mm/r01", *runs[:-1]]
    assert whole.joined() == whole.described
    parted = divide(["0mm/r01", *runs], 10)
    assert list(parted.described) == ["0mm/batch", "3mm/batch-0", "3mm/batch-1"]
    assert not parted.alone
    # Each batch is joined once, by the one that holds its recordings.
    joined = [batch for names in parted.joined().values() for batch in names]
    assert sorted(joined) == list(parted.batches)
    assert list(divide(runs, 1000).described) == ["3mm/batch"]


NAMES = [f"{folder}/r{run:02d}" for folder in ("0mm", "3mm") for run in range(1, 8)]
REJECTED = ["3mm/\\udcff", "3mm/a b:c"]
LAGS = {name: int(name[-2:]) for name in NAMES}


def array_of(name):
    """Return the readings of a recording; each has its own length, and one value is missing."""
    values = np.arange(4.0 * int(name[-2:])).reshape(4, -1)
    values[0, 0] = np.nan
    return values


def make_results(folder, size):
    """Write the results of an archive in batches of a size, and return them."""

    def file(kind, batch):
        return folder / store.pattern(kind, alone=size == 1).format(batch=batch)

    for batch, members in batches(NAMES, size).items():
        for kind in (SIGNALS, MATRICES):
            store.write_arrays(file(kind, batch), {name: array_of(name) for name in members})
        for kind in (CHECKS, FITS):
            contents = {name: {"recording": name, "lag": LAGS[name]} for name in members}
            store.write_contents(file(kind, batch), contents, batch)
    # A recording that was rejected has no batch, and no file.
    cells = rows_of(NAMES, size) | dict.fromkeys(REJECTED, dict.fromkeys(store.BATCH_COLUMNS))
    rows = [{"recording": name, **own} for name, own in cells.items()]
    files.write_csv(folder / "recordings.csv", ["recording", *store.BATCH_COLUMNS], rows)
    return store.Results.of_table(folder, folder / "recordings.csv")


# Batches of two were once not found, because sizes were tried.
@pytest.mark.parametrize("size", [1, 2, 3, 100])
def test_each_recording_is_read_as_it_was_written(tmp_path, size):
    results = make_results(tmp_path, size)
    assert sorted(results.names) == NAMES
    assert list(results.fits(NAMES[::-1])) == NAMES[::-1]
    assert list(results.checks(NAMES[3::4])) == NAMES[3::4]
    assert {name: fit["lag"] for name, fit in results.fits(NAMES).items()} == LAGS
    # A job finds its recordings in the paths of its batches.
    paths = list(dict.fromkeys(results.file(SIGNALS, name) for name in NAMES[7:]))
    found = list(store.arrays_in(paths, NAMES[7:]))
    assert [name for name, _ in found] == NAMES[7:]
    found += [(name, read(name)) for name in NAMES for read in (results.signal, results.matrix)]
    for name, array in found:
        np.testing.assert_array_equal(array, array_of(name))
    # The checks tell the batch of each recording.
    rows, checks = store.read_checks(tmp_path, divide(NAMES, size).joined())
    assert rows == rows_of(NAMES, size)
    assert {name: check["lag"] for name, check in checks.items()} == LAGS


def test_what_a_file_holds_of_some_recordings_is_read_once(tmp_path):
    results = store.Results(tmp_path, rows_of(NAMES))
    read = Mock(return_value={"0mm/r01": 1, "3mm/r01": 3, "3mm/r02": 5})
    # The last was rejected.
    found = results.described(store.FEATURES, ["3mm/r01", "0mm/r01", "3mm/r07"], read)
    assert found == {"3mm/r01": 3, "0mm/r01": 1}
    names = ("features/3mm/batch.npz", "features/0mm/batch.npz")
    assert read.call_args_list == [call(tmp_path / name) for name in names]


# numpy reads a header as Python; this one has lost a bracket.
HEADER = b"\x93NUMPY\x01\x00\x76\x00%-117s\n" % b"{'descr': '<f8', 'shape': 4, 1000), }"


@pytest.mark.parametrize("size", [1, 10])
@pytest.mark.parametrize("kind", [MATRICES, FITS])
def test_a_damaged_and_a_missing_file_are_named_with_the_remedy(tmp_path, size, kind):
    results = make_results(tmp_path, size)
    path = results.file(kind, "3mm/r07")

    def told():
        with pytest.raises(CapsuleError) as caught:
            results.matrix("3mm/r07") if kind == MATRICES else results.fits(["3mm/r07"])
        return str(caught.value)

    # A point matches no line end.
    damaged = rf"{path} is damaged \(.*\); delete it, and make it again: snakemake -c2"
    cut = path.read_bytes()[:-20]
    for content in (cut, b"", b"\xff\0 garbage", b"PK", b"[1]", b"{}", HEADER):
        path.write_bytes(content)
        assert re.fullmatch(damaged, told())
    path.unlink()
    assert told() == f"{path} does not exist; make all that is missing: snakemake -c2"


def test_files_of_a_recording_that_is_gone_or_of_another_size_are_left_over(tmp_path):
    def left(names=NAMES, size=1):
        found = left_over(tmp_path, divide(names, size))
        return [path.removeprefix(f"{tmp_path}/") for path in found]

    assert left() == []
    make_results(tmp_path, 1)
    assert left() == []
    assert len(left(size=10)) == 4 * len(NAMES)
    files.write_json(tmp_path / "plot_data/2mm/batch.json", {})
    names = ["checks/{}.json", "fits/{}.json", "matrices/{}.np{}", "signals/{}.np{}"]
    gone = [name.format("3mm/r07", "y") for name in names]
    assert left(NAMES[:-1]) == sorted([*gone, "plot_data/2mm/batch.json"])
    make_results(tmp_path, 10)
    made = [name.format(batch, "z") for name in names for batch in ("0mm/batch", "3mm/batch")]
    assert left() == sorted([*made, "plot_data/2mm/batch.json"])


def test_results_are_out_of_date_when_recordings_came_went_or_changed(tmp_path):
    results, raw = tmp_path / "results", tmp_path / "raw"
    write_archive(raw, names := ["3mm/r07", "3mm/r08", "0mm/r01"], samples=50)
    # A folder that is named like a file cannot be read, so nothing is known of its content.
    (raw / "3mm/folder.csv").mkdir()
    rows = [(name, files.fingerprint(raw / f"{name}.csv", 10**6)) for name in names]
    rows.append(("3mm/folder", ""))
    files.write_cells(results / "recordings.csv", ["recording", "sha256"], rows)

    def changed():
        return store.changed_recordings(results, {"recording": {"max_megabytes": 1}})

    # The date of a recording does not count.
    os.utime(raw / "3mm/r07.csv", (1, 1))
    assert changed() == []
    (raw / "3mm/r07.csv").write_text("# a comment")
    (raw / "3mm/r08.csv").unlink()
    write_archive(raw, ["2mm/new"], samples=50)
    (raw / "notes.txt").touch()
    assert changed() == [f"raw/{name}.csv" for name in ("2mm/new", "3mm/r07", "3mm/r08")]
    # Without recordings, nothing is known.
    shutil.rmtree(raw)
    assert changed() == []
