"""A damaged file of any format comes in or is refused in a line, without much memory or time.

`tests/benchmarks/fuzz_import.py` tries many more of them.
"""

import faulthandler
import os
import signal
import sys

import numpy as np
import pytest

from capsule.importing import reading_apart
from support.damaged_files import damaged, given_path, write_each_format
from support.importing import import_files
from support.marks import needs_forks

pytestmark = pytest.mark.takes(1)

ENDINGS = ".csv .log .gz .npy .npz .mat 73.mat .h5 .nc .xlsx .nwb .tdms .xdf .bag .mcap .sqlite3"
ENDINGS = ENDINGS.split()
DAMAGED_EACH = 8


def most_memory():
    """Return the largest memory of this process so far in bytes; 0 if the system does not tell."""
    if sys.platform != "linux":
        return 0
    import resource

    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    return write_each_format(tmp_path_factory.mktemp("whole"))


def test_each_format_is_tried(tmp_path, whole):
    assert list(whole) == ENDINGS
    for file in whole.values():
        imported = import_files(tmp_path, given_path(file), "--dry-run")
        assert imported.refused == "", file


@pytest.mark.parametrize("ending", ENDINGS)
def test_a_damaged_file_comes_in_or_is_refused_in_a_line(tmp_path, whole, ending):
    file, rng = whole[ending], np.random.default_rng(ENDINGS.index(ending))
    content, most_before = file.read_bytes(), most_memory()
    cut = [content[: int(kept * len(content))] for kept in (0.1, 0.5, 0.9)]
    try:
        for number, each in enumerate(
            [*(damaged(content, rng) for _ in range(DAMAGED_EACH)), *cut]
        ):
            file.write_bytes(each)
            imported = import_files(tmp_path / str(number), given_path(file), "--dry-run")
            assert imported.refused.count("\n") == imported.status
            assert bool(imported.refused) != ("would write" in imported.shown)
    finally:
        file.write_bytes(content)
    assert most_memory() <= max(most_before, 1_000_000_000)


@needs_forks  # elsewhere, files are read in this process
def test_a_package_that_crashes_at_a_file_does_not_end_the_import(tmp_path, whole, monkeypatch):
    def crash(*_, **__):
        # Otherwise pytest shows where, and that looks like a crash of the tests.
        faulthandler.disable()
        os.kill(os.getpid(), signal.SIGSEGV)

    monkeypatch.setattr(np, "load", crash)
    imported = import_files(tmp_path, whole[".npy"], whole[".mat"], "--dry-run")
    assert (
        "run.npy: the package that reads this format crashed at it, or came to no end; copy or"
        in imported.refused
    )
    assert imported.counted == "1 recording would be imported, 1 file refused"


@needs_forks  # elsewhere, files are read in this process
@pytest.mark.parametrize(
    ("load", "told"),
    [
        (lambda *_, **__: any(iter(int, 1)), "the package that reads this format crashed at it"),
        (lambda *_, **__: bytes(2_000_000_000), "the numpy file cannot be read (MemoryError)"),
    ],
    ids=["no end", "2 GB"],
)
def test_a_package_is_ended_that_takes_too_long_or_too_much(
    tmp_path, whole, monkeypatch, load, told
):
    monkeypatch.setattr(np, "load", load)
    monkeypatch.setattr(reading_apart, "_SECONDS", 1)
    assert f"run.npy: {told}" in import_files(tmp_path, whole[".npy"], "--dry-run").refused


@needs_forks  # elsewhere, files are read in this process
def test_a_file_of_a_run_may_take_five_seconds_at_most(monkeypatch):
    import resource

    limits = []
    monkeypatch.setattr(resource, "setrlimit", lambda _, limit: limits.append(limit))
    # As large as the damaged NWB file in which HDF5 followed a chain of addresses without an end.
    reading_apart.limit_process("NWB file", bytes(174_152))
    (seconds, most), _ = limits
    assert 2 <= seconds == most <= 5


@needs_forks  # elsewhere, files are read in this process
def test_a_limit_that_a_cluster_has_set_is_not_raised(monkeypatch):
    import resource

    raised = []
    monkeypatch.setattr(resource, "getrlimit", lambda _: (1, 1))
    monkeypatch.setattr(resource, "setrlimit", lambda *limit: raised.append(limit))
    reading_apart.limit_process("HDF5 file", bytes(1000))
    assert not raised
