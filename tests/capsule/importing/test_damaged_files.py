"""A damaged file of any format comes in or is refused in a line, without much memory or time.

`tests/benchmarks/fuzz_import.py` tries many more of them, and measures memory and time.
"""

import faulthandler
import gzip
import io
import os
import signal
import tracemalloc
import zipfile
from unittest.mock import Mock

import h5py
import numpy as np
import openpyxl
import pytest
import scipy.io
from hypothesis import given, settings
from hypothesis import strategies as st

from capsule.errors import CapsuleError
from capsule.importing import reading_apart, text
from capsule.importing.lab_yaml import checked_keys
from capsule.importing.runs import read_columns, runs_of
from capsule.recordings.recording import format_recording, read_recording
from support.damaged_files import ENDINGS, damaged, given_path, write_each_format
from support.importing import ODD, SETTINGS, import_files
from support.marks import needs_forks

pytestmark = pytest.mark.takes(1)


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    return write_each_format(tmp_path_factory.mktemp("whole"))


@pytest.mark.parametrize("ending", ENDINGS)
def test_a_damaged_file_comes_in_or_is_refused_in_a_line(tmp_path, whole, ending):
    assert list(whole) == ENDINGS, "each format is tried"
    file, rng = whole[ending], np.random.default_rng(ENDINGS.index(ending))
    content = file.read_bytes()
    cut = [content[: int(kept * len(content))] for kept in (0.2, 0.9)]
    try:
        for number, each in enumerate([content, *cut, *(damaged(content, rng) for _ in range(4))]):
            file.write_bytes(each)
            imported = import_files(tmp_path / str(number), given_path(file), "--dry-run")
            assert number > 0 or imported.refused == "", "the whole file comes in"
            assert imported.refused.count("\n") == imported.status
            assert bool(imported.refused) != ("would write" in imported.shown)
    finally:
        file.write_bytes(content)


# What a package does at a file, and what is told of it.
AT_A_FILE = {
    "crash": (lambda: os.kill(os.getpid(), signal.SIGSEGV), "reads this format crashed at it, or"),
    "no end": (lambda: any(iter(int, 1)), "reads this format crashed at it, or came to no end"),
    "2 GB": (lambda: bytes(2_000_000_000), "the numpy file cannot be read (MemoryError)"),
}


@needs_forks  # elsewhere, files are read in this process
@pytest.mark.parametrize("kind", AT_A_FILE)
def test_a_package_that_crashes_or_takes_too_much_does_not_end_the_import(
    tmp_path, whole, monkeypatch, kind
):
    act, told = AT_A_FILE[kind]
    # Otherwise pytest shows where, and that looks like a crash of the tests.
    monkeypatch.setattr(np, "load", lambda *_, **__: [faulthandler.disable(), act()])
    if kind == "no end":
        monkeypatch.setattr(reading_apart, "_SECONDS", 1)
    imported = import_files(tmp_path, whole[".npy"], whole[".mat"], "--dry-run")
    assert "run.npy: " in imported.refused and told in imported.refused
    assert imported.counted == "1 recording would be imported, 1 file refused"


def test_what_cannot_be_imported_beforehand_is_left_to_the_reader(tmp_path, whole, monkeypatch):
    monkeypatch.setattr(reading_apart, "import_module", Mock(side_effect=ImportError("libhdf5")))
    assert import_files(tmp_path, whole[".npy"], "--dry-run").refused == ""


@needs_forks  # elsewhere, files are read in this process
def test_a_file_of_a_run_may_take_five_seconds_at_most_and_no_limit_is_raised(monkeypatch):
    import resource

    limits = []
    monkeypatch.setattr(resource, "setrlimit", lambda _, limit: limits.append(limit))
    # As large as the damaged NWB file in which HDF5 followed a chain of addresses without an end.
    reading_apart.limit_process("NWB file", bytes(174_152))
    (seconds, most), _ = limits
    assert 2 <= seconds == most <= 5
    # A cluster has set limits already.
    monkeypatch.setattr(resource, "getrlimit", lambda _: (1, 1))
    reading_apart.limit_process("HDF5 file", bytes(1000))
    assert len(limits) == 2


def test_a_small_file_that_holds_very_much_is_refused_before_it_is_unpacked(tmp_path):
    (tmp_path / "text.csv.gz").write_bytes(gzip.compress(bytes(2_000_000)) * 51)
    scipy.io.savemat(tmp_path / "a.mat", {"V": np.zeros((3_000_000, 5))}, do_compression=True)
    with h5py.File(tmp_path / "a.h5", "w") as file:
        for number in range(10):
            file.create_dataset(f"V{number}", (2_000_000,), "f8", chunks=(1000,))
    with zipfile.ZipFile(tmp_path / "a.xlsx", "w", zipfile.ZIP_DEFLATED) as packed:
        packed.writestr("xl/workbook.xml", bytes(101_000_000))
    book = openpyxl.Workbook()
    book.active.cell(1_048_576, 5).value = 1
    book.save(tmp_path / "tall.xlsx")
    # It is slow to look through.
    (tmp_path / "lines.txt").write_bytes((b"a b " * 20_000 + b":\n") * 4)
    with (tmp_path / "a.npy").open("wb") as stream:
        head = {"descr": "<f8", "fortran_order": False, "shape": (10**10, 5)}
        np.lib.format.write_array_header_1_0(stream, head)
    too_large = "unpacked, it is larger than 100 MB, too large for one"
    reasons = dict.fromkeys(["a.h5", "a.mat", "a.xlsx", "text.csv.gz"], too_large) | {
        "a.npy": "Unable to allocate 373. GiB",
        "lines.txt": "line 3: there is no table with 4 columns",
        "tall.xlsx": "sheet 'Sheet' has 1048576 rows and 5 columns, too many",
    }
    refused = import_files(tmp_path / "out", *sorted(tmp_path.iterdir())).refused.splitlines()
    for line, (name, reason) in zip(refused, sorted(reasons.items()), strict=True):
        assert f"{name}: " in line and reason in line


def test_a_long_text_takes_little_memory(monkeypatch):
    monkeypatch.setattr(text, "_MOST_TRIED", 2000)  # lines whose parts are held at once
    rows = [f"{n / 1e3:.3f},{n % 7}.25,{n % 97}.5,{n % 89}.125,7" for n in range(8000)]
    content = "\n".join(["time,S1,S2,S3,S4", *rows, ""]).encode()
    tracemalloc.start()
    table = text.read_text(content, checked_keys({}, SETTINGS))
    _, most = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert table.lines.size == 8000 and most < 9 * len(content)


FILES = [path.read_bytes() for path in sorted(ODD.iterdir())]
SAID = [{}, {"unit": "V"}, {"rate": 10.0, "time": "none"}, {"run_gap_s": 0.5}, {"time": 1}]
PIECES = [b"nan", b"inf", b"1e400", b"-", b'"', b"\n\n", b"\x00", b"\xff", b",,", b"00:00:00"]
PIECE = st.sampled_from(PIECES) | st.binary(max_size=4)
DAMAGES = st.lists(st.tuples(st.integers(0, 400), st.integers(0, 20), PIECE), max_size=5)


@settings(max_examples=200, deadline=None)
@given(st.sampled_from(FILES), DAMAGES, st.sampled_from(SAID))
def test_a_damaged_text_is_read_or_refused_in_a_line(content, damages, said):
    for at, length, piece in damages:
        content = content[:at] + piece + content[at + length :]
    keys = checked_keys(said, SETTINGS)
    try:
        runs = list(runs_of(read_columns(text.read_text(content, keys), keys), {}, keys))
    except CapsuleError as refusal:
        assert "\n" not in str(refusal)
        return
    for _, recording, _ in runs:
        back = read_recording(io.BytesIO(format_recording(recording)), 4)
        np.testing.assert_array_equal(back.values, recording.values)
