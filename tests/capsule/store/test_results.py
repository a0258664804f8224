"""The files of recordings are written, found and read again, alone or in batches."""

import os
import re
import shutil
from unittest.mock import Mock, call

import numpy as np
import pytest

from capsule.errors import CapsuleError
from capsule.store import files
from capsule.store.results import (
    BATCH_COLUMNS,
    CHECKS,
    FEATURES,
    FITS,
    MATRICES,
    SIGNALS,
    Results,
    arrays_in,
    batches,
    changed_recordings,
    divide,
    left_over,
    pattern,
    read_checks,
    write_arrays,
    write_contents,
)
from support.stored import rows_of
from support.synthetic import write_archive

NAMES = [f"{folder}/r{run:02d}" for folder in ("0mm", "3mm") for run in range(1, 8)]
REJECTED = ["3mm/\\udcff", "3mm/a b:c"]
LAGS = {name: int(name[-2:]) for name in NAMES}


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
            contents = {name: {"recording": name, "lag": LAGS.get(name)} for name in members}
            path = folder / pattern(kind, alone=size == 1).format(batch=batch)
            write_contents(path, contents, batch)
    rows = [{"recording": name, **cells} for name, cells in rows_of(names, size).items()]
    # A recording that was rejected has no batch, and no file.
    rows += [{"recording": name} | dict.fromkeys(BATCH_COLUMNS, "") for name in REJECTED]
    files.write_csv(folder / "recordings.csv", ["recording", *BATCH_COLUMNS], rows)
    return Results.of_table(folder, folder / "recordings.csv")


# Batches of two were once not found, because sizes were tried.
@pytest.mark.parametrize("size", [1, 2, 3, 100])
def test_each_recording_is_read_as_it_was_written(tmp_path, size):
    results = make_results(tmp_path, size)
    assert sorted(results.names) == NAMES
    for name in NAMES:
        np.testing.assert_array_equal(results.signal(name), array_of(name))
        np.testing.assert_array_equal(results.matrix(name), array_of(name))
    assert list(results.fits(NAMES[::-1])) == NAMES[::-1]
    assert list(results.checks(NAMES[3::4])) == NAMES[3::4]
    assert {name: fit["lag"] for name, fit in results.fits(NAMES).items()} == LAGS
    # A job finds its recordings in the paths of its batches.
    wanted = NAMES[7:]
    paths = list(dict.fromkeys(results.file(SIGNALS, name) for name in wanted))
    found = dict(arrays_in(paths, wanted))
    assert list(found) == wanted
    for name, array in found.items():
        np.testing.assert_array_equal(array, array_of(name))
    # The checks tell the batch of each recording.
    rows, checks = read_checks(tmp_path, divide(NAMES, size).joined())
    assert rows == rows_of(NAMES, size)
    assert {name: check["lag"] for name, check in checks.items()} == LAGS


def test_what_a_file_holds_of_some_recordings_is_read_once(tmp_path):
    results = Results(tmp_path, rows_of(NAMES))
    read = Mock(return_value={"0mm/r01": 1, "3mm/r01": 3, "3mm/r02": 5})
    # No recording is there that was rejected.
    wanted = ["3mm/r01", "0mm/r01", "3mm/r07"]
    assert results.described(FEATURES, wanted, read) == {"3mm/r01": 3, "0mm/r01": 1}
    names = ("features/3mm/batch.npz", "features/0mm/batch.npz")
    assert read.call_args_list == [call(tmp_path / name) for name in names]


# numpy reads a header as Python; this one has lost a bracket.
HEADER = b"\x93NUMPY\x01\x00\x76\x00%-117s\n" % b"{'descr': '<f8', 'shape': 4, 1000), }"
DAMAGES = {
    "cut short": lambda content: content[:-20],
    "empty": lambda content: b"",
    "garbage": lambda content: b"\x00 garbage",
    "no archive": lambda content: b"PK",
    "no keys": lambda content: b"[1]",
    "none of its own": lambda content: b"{}",
    "no header": lambda content: HEADER,
    "missing": None,
}


@pytest.mark.parametrize("size", [1, 10])
@pytest.mark.parametrize("damage", DAMAGES)
@pytest.mark.parametrize("kind", [MATRICES, FITS])
def test_a_damaged_and_a_missing_file_are_named_with_the_remedy(tmp_path, size, damage, kind):
    results = make_results(tmp_path, size)
    path = results.file(kind, "3mm/r07")
    if DAMAGES[damage]:
        path.write_bytes(DAMAGES[damage](path.read_bytes()))
        told = rf"{path} is damaged \(.*\); delete it, and make it again: snakemake -c2"
    else:
        path.unlink()
        told = f"{path} does not exist; make all that is missing: snakemake -c2"
    with pytest.raises(CapsuleError) as caught:
        results.matrix("3mm/r07") if kind == MATRICES else results.fits(["3mm/r07"])
    # A point matches no line end.
    assert re.fullmatch(told, str(caught.value))


def test_files_of_a_recording_that_is_gone_or_of_another_size_are_left_over(tmp_path):
    def left(names=NAMES, size=1, folder=tmp_path):
        found = left_over(folder, divide(names, size))
        return [path.removeprefix(f"{folder.as_posix()}/") for path in found]

    make_results(tmp_path, 1)
    assert left(folder=tmp_path / "none") == left() == []
    assert len(left(size=10)) == 4 * len(NAMES)
    files.write_json(tmp_path / "plot_data/2mm/batch.json", {})
    assert left([name for name in NAMES if name != "3mm/r07"]) == [
        *("checks/3mm/r07.json", "fits/3mm/r07.json", "matrices/3mm/r07.npy"),
        *("plot_data/2mm/batch.json", "signals/3mm/r07.npy"),
    ]
    make_results(tmp_path, 10)
    names = ["signals/{}.npz", "matrices/{}.npz", "fits/{}.json", "checks/{}.json"]
    made = [name.format(batch) for name in names for batch in ("0mm/batch", "3mm/batch")]
    assert left() == sorted([*made, "plot_data/2mm/batch.json"])


def test_results_are_out_of_date_when_recordings_came_went_or_changed(tmp_path):
    results, raw = tmp_path / "results", tmp_path / "raw"
    write_archive(raw, ["3mm/r07", "3mm/r08", "0mm/r01"], samples=50)
    sums = [(f"{path.parent.name}/{path.stem}", files.fingerprint(path, 10**6))
            for path in raw.glob("*/*.csv")]  # fmt: skip
    # A folder that is named like a file cannot be read, so nothing is known of its content.
    (raw / "3mm/folder.csv").mkdir()
    files.write_cells(
        results / "recordings.csv", ["recording", "sha256"], [*sums, ("3mm/folder", "")]
    )

    def changed():
        return changed_recordings(results, {"recording": {"max_megabytes": 1}})

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
