"""The files of recordings are written, found and read again, alone or in batches."""

import numpy as np
import pytest

from capsule.engine.forks import Forks
from capsule.errors import CapsuleError
from capsule.store import files
from capsule.store.batches import batches, described_together
from capsule.store.results import (
    BATCH_COLUMNS,
    CHECKS,
    FEATURES,
    FITS,
    MATRICES,
    PLOT_DATA,
    SIGNALS,
    Results,
    arrays_in,
    left_over,
    pattern,
    read_array,
    read_checks,
    write_arrays,
    write_contents,
)
from support.stored import rows_of

NAMES = [f"{folder}/r{run:02d}" for folder in ("0mm", "3mm") for run in range(1, 8)]


def array_of(name):
    """Return the readings of a recording; each has its own length, and one value is missing."""
    values = np.arange(4.0 * int(name[-2:])).reshape(4, -1)
    values[0, 0] = np.nan
    return values


def make_results(folder, size, names=NAMES):
    """Write the results of an archive in batches of a size, and return them."""
    for batch, members in batches(names, size).items():
        for kind in (SIGNALS, MATRICES):
            arrays = {name: array_of(name) for name in members}
            write_arrays(folder / pattern(kind, alone=size == 1).format(batch=batch), arrays)
        for kind in (CHECKS, FITS):
            contents = {name: {"recording": name, "lag": int(name[-2:])} for name in members}
            write_contents(
                folder / pattern(kind, alone=size == 1).format(batch=batch), contents, batch
            )
    rows = [{"recording": name, **cells} for name, cells in rows_of(names, size).items()]
    files.write_csv(folder / "recordings.csv", ["recording", *BATCH_COLUMNS], rows)
    return Results.of_table(folder, folder / "recordings.csv")


@pytest.mark.parametrize(
    ("kind", "size", "expected"),
    [
        (SIGNALS, 1, "signals/{batch}.npy"),
        (MATRICES, 10, "matrices/{batch}.npz"),
        (FITS, 1, "fits/{batch}.json"),
        (CHECKS, 10, "checks/{batch}.json"),
        (FEATURES, 1, "features/{batch}.npz"),
        (PLOT_DATA, 10, "plot_data/{batch}.json"),
    ],
)
def test_a_batch_of_several_has_the_file_of_a_recording_under_its_own_name(kind, size, expected):
    assert pattern(kind, alone=size == 1) == expected


@pytest.mark.parametrize("size", [1, 3, 100])
def test_each_recording_is_read_as_it_was_written(tmp_path, size):
    results = make_results(tmp_path, size)
    for name in NAMES:
        np.testing.assert_array_equal(results.signal(name), array_of(name))
        np.testing.assert_array_equal(results.matrix(name), array_of(name))
    some = NAMES[3::4]
    assert list(results.fits(NAMES[::-1])) == NAMES[::-1]
    assert list(results.checks(some)) == some
    assert {name: fit["lag"] for name, fit in results.fits(NAMES).items()} == {
        name: int(name[-2:]) for name in NAMES
    }


@pytest.mark.parametrize("shape", [(4, 1000), (3, 50), (1, 7)])
def test_an_array_is_read_as_numpy_reads_it(tmp_path, shape):
    arrays = {f"3mm/r{run}": np.random.default_rng(run).normal(size=shape) for run in (1, 2)}
    write_arrays(tmp_path / "batch.npz", arrays)
    write_arrays(tmp_path / "r1.npy", {"3mm/r1": arrays["3mm/r1"]})
    alone = np.load(tmp_path / "r1.npy")
    np.testing.assert_array_equal(read_array(tmp_path / "r1.npy", "3mm/r1"), alone)
    with np.load(tmp_path / "batch.npz") as stored:
        for name in arrays:
            np.testing.assert_array_equal(read_array(tmp_path / "batch.npz", name), stored[name])


def test_forks_read_the_archives_that_their_starter_has_open(tmp_path):
    names = [f"3mm/r{run:02d}" for run in range(1, 81)]
    results = make_results(tmp_path, 100, names)
    results.matrix(names[0])

    def largest(name):
        return float(np.nanmax(results.matrix(name)))

    assert list(Forks(2)(largest, names)) == [4.0 * int(name[-2:]) - 1 for name in names]


@pytest.mark.parametrize("size", [1, 2, 3, 100])
def test_a_job_finds_its_recordings_in_the_paths_of_its_batches(tmp_path, size):
    # Batches of two were once not found, because sizes were tried.
    results = make_results(tmp_path, size)
    wanted = NAMES[7:]
    paths = list(dict.fromkeys(results.file(SIGNALS, name) for name in wanted))
    found = dict(arrays_in(paths, wanted))
    assert list(found) == wanted
    for name, array in found.items():
        np.testing.assert_array_equal(array, array_of(name))


@pytest.mark.parametrize("size", [1, 2, 100])
def test_the_checks_tell_the_batch_of_each_recording(tmp_path, size):
    make_results(tmp_path, size)
    divided, described = batches(NAMES, size), described_together(NAMES, size)
    joined = {
        name: [batch for batch, names in divided.items() if set(names) <= set(members)]
        for name, members in described.items()
    }
    rows, checks = read_checks(tmp_path, joined)
    assert rows == rows_of(NAMES, size)
    assert {name: check["lag"] for name, check in checks.items()} == {
        name: int(name[-2:]) for name in NAMES
    }


def test_names_that_are_no_recordings_have_no_file(tmp_path):
    # The list names them with the reason why they were rejected, and without a batch.
    rows = [{"recording": name, "batch": ""} for name in ("3mm/\\udcff", "3mm/a b:c")]
    rows += [{"recording": "3mm/r01", "batch": "3mm/r01"}]
    files.write_csv(tmp_path / "recordings.csv", ["recording", "batch"], rows)
    assert Results.of_table(tmp_path, tmp_path / "recordings.csv").names == ("3mm/r01",)


def test_what_a_file_holds_of_some_recordings_is_read_once(tmp_path):
    results, read = Results(tmp_path, rows_of(NAMES)), []

    def read_lengths(path):
        read.append(path.relative_to(tmp_path).as_posix())
        return {"0mm/r01": 1, "3mm/r01": 3, "3mm/r02": 5}

    # No recording is there that was rejected.
    wanted = ["3mm/r01", "0mm/r01", "3mm/r07"]
    assert results.described(FEATURES, wanted, read_lengths) == {"3mm/r01": 3, "0mm/r01": 1}
    assert read == ["features/3mm/batch.npz", "features/0mm/batch.npz"]


# numpy reads a header as Python; this one has lost a bracket.
HEADER = b"\x93NUMPY\x01\x00\x76\x00%-117s\n" % b"{'descr': '<f8', 'shape': 4, 1000), }"


@pytest.mark.parametrize("size", [1, 10])
@pytest.mark.parametrize("content", [b"", b"\x00 garbage", b"PK", b"{}", b"[1]", HEADER, None])
@pytest.mark.parametrize("read", ["matrix", "fit"])
def test_a_damaged_and_a_missing_file_are_named_with_the_remedy(tmp_path, size, content, read):
    results = make_results(tmp_path, size)
    path = results.file(MATRICES if read == "matrix" else FITS, "3mm/r01")
    path.unlink() if content is None else path.write_bytes(content)
    with pytest.raises(CapsuleError) as caught:
        results.matrix("3mm/r01") if read == "matrix" else results.fits(["3mm/r01"])
    if content is None:
        assert (
            str(caught.value) == f"{path} does not exist; make all that is missing: snakemake -c2"
        )
    else:
        assert str(caught.value).startswith(f"{path} is damaged (")
        assert str(caught.value).endswith("); delete it, and make it again: snakemake -c2")
    assert "\n" not in str(caught.value)


def test_a_file_cut_short_is_damaged(tmp_path):
    for size in (1, 10):
        results = make_results(tmp_path / str(size), size)
        path = results.file(SIGNALS, "3mm/r07")
        path.write_bytes(path.read_bytes()[:-20])
        with pytest.raises(CapsuleError, match="is damaged"):
            results.signal("3mm/r07")
        path = results.file(CHECKS, "3mm/r07")
        path.write_bytes(path.read_bytes()[:-3])
        with pytest.raises(CapsuleError, match="is damaged"):
            results.checks(["3mm/r07"])


def left_in(folder, names, size):
    """Return what is left over, without the folder."""
    now, described = batches(names, size), described_together(names, size)
    found = left_over(folder, size, now, described)
    return [path.removeprefix(f"{folder.as_posix()}/") for path in found]


def test_of_an_archive_as_it_is_nothing_is_left_over(tmp_path):
    for size in (1, 3):
        make_results(tmp_path / str(size), size)
        assert left_in(tmp_path / str(size), NAMES, size) == []
    assert left_in(tmp_path / "none", NAMES, 1) == []


def test_files_of_a_recording_that_is_gone_are_left_over(tmp_path):
    make_results(tmp_path, 1)
    files.write_json(tmp_path / "plot_data/2mm/batch.json", {})
    assert left_in(tmp_path, [name for name in NAMES if name != "3mm/r07"], 1) == [
        "checks/3mm/r07.json",
        "fits/3mm/r07.json",
        "matrices/3mm/r07.npy",
        "plot_data/2mm/batch.json",
        "signals/3mm/r07.npy",
    ]


def test_files_of_another_size_are_left_over(tmp_path):
    make_results(tmp_path, 1)
    assert "signals/0mm/r01.npy" in left_in(tmp_path, NAMES, 10)
    assert len(left_in(tmp_path, NAMES, 10)) == 4 * len(NAMES)
    make_results(tmp_path, 10)
    assert len(left_in(tmp_path, NAMES, 1)) == 4 * len(["0mm/batch", "3mm/batch"])
