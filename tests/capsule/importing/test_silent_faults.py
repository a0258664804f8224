"""What the import would take wrongly without a word is refused, asked for or named."""

import gzip
import io
import os
import re
import shlex
import tracemalloc
import zipfile

import h5py
import numpy as np
import openpyxl
import pytest
import scipy.io
import yaml
from rosbags.rosbag2 import StoragePlugin

from capsule.importing.command import _tell
from capsule.importing.formats import read_source
from capsule.importing.lab_yaml import checked_keys
from capsule.recordings.acceptance import check_recording
from support.importing import SETTINGS, assert_readings, import_files, lines, write_table
from support.lab_files import (
    COUNTS,
    KILO_OHMS,
    TIME_S,
    excel_rows,
    nwb_file,
    write_bag_2,
    write_hdf,
    write_workbook,
)
from support.project import ROOT


@pytest.fixture
def good(tmp_path):
    return write_table(tmp_path / "monday.csv", TIME_S, *COUNTS)


def test_lab_yaml_keeps_the_order_of_day_and_month_that_was_found(tmp_path):
    files = [tmp_path / "day13.csv", tmp_path / "day4.csv"]
    for path, day in zip(files, (13, 4), strict=True):
        stamps = [f"{day:02}/03/2026 12:00:{second:04.1f}" for second in TIME_S]
        path.write_text(lines(stamps, *COUNTS + day, head="date,S1,S2,S3,S4"))
    import_files(tmp_path, files[0])
    imported = import_files(tmp_path, files[1], "--map", tmp_path / "lab.yaml")
    assert imported.refused == ""
    assert imported.recordings()["3mm/day4"].header["started"] == "2026-03-04T12:00:00"


def test_a_question_common_to_many_files_is_asked_once_and_another_one_beside_it(tmp_path):
    files = [
        write_table(tmp_path / f"{n}.csv", TIME_S, *COUNTS / 1024 * 5 + n / 100, head="t,a,b,c,d")
        for n in range(4)
    ]
    clocks = write_table(tmp_path / "c.csv", TIME_S, TIME_S, *COUNTS, head="time,clock,S1,S2,S3,S4")
    imported = import_files(tmp_path, *files[:2], clocks, *files[2:])
    first, other, alike = imported.refused.splitlines()
    assert first.startswith(f"refused: {files[0]}: column 'a': readings from ")
    assert "can be V (--unit V) or kohm (--unit kohm); choose one" in first
    assert "the columns 'time', 'clock' can all be the time" in other
    names = ", ".join(map(str, files[1:]))
    assert alike == f"refused: {names}: the same question as for {files[0]}"
    assert imported.counted == "0 recordings imported, 5 files refused"


def test_a_huge_file_in_the_archive_is_not_read(tmp_path, good):
    (tmp_path / "raw/3mm").mkdir(parents=True)
    with (tmp_path / "raw/3mm/r01.csv").open("wb") as stream:
        stream.truncate(300_000_000_000)  # a hole takes no room on the disk
    assert import_files(tmp_path, good).counted == "1 recording imported, 0 files refused"


def test_a_reader_that_ends_early_does_not_stop_the_import():
    read, write = os.pipe()
    os.close(read)
    with os.fdopen(write, "w") as stream:
        for text in ("one file", "another"):
            _tell(text, stream)


def test_a_sheet_that_states_too_few_rows_is_read_whole(tmp_path):
    write_workbook(tmp_path / "whole.xlsx", {"Run 1": excel_rows(TIME_S.tolist())})
    with zipfile.ZipFile(tmp_path / "whole.xlsx") as whole:
        parts = {name: whole.read(name) for name in whole.namelist()}
    sheet = "xl/worksheets/sheet1.xml"
    parts[sheet], changed = re.subn(rb'ref="A1:E[0-9]+"', b'ref="A1:C60"', parts[sheet])
    assert changed
    with zipfile.ZipFile(tmp_path / "lab.xlsx", "w") as stated:
        for name, content in parts.items():
            stated.writestr(name, content)
    recording = import_files(tmp_path, tmp_path / "lab.xlsx").the_recording()
    assert_readings(recording, TIME_S, KILO_OHMS)


def outside_hdf(folder):
    """Write files whose samples lie outside of them, and return their paths."""
    files = [folder / name for name in ("external.h5", "virtual.h5", "linked.h5", "linked.nwb")]
    (folder / "secret.bin").write_bytes(COUNTS.T.tobytes())
    write_hdf(folder / "other.h5", {"V": COUNTS.T})
    shape, other = COUNTS.T.shape, str(folder / "other.h5")
    with h5py.File(files[0], "w") as file:
        parts = [(str(folder / "secret.bin"), 0, h5py.h5f.UNLIMITED)]
        file.create_dataset("V", shape, "f8", external=parts)
    with h5py.File(files[1], "w") as file:
        layout = h5py.VirtualLayout(shape, "f8")
        layout[...] = h5py.VirtualSource(other, "V", shape)
        file.create_virtual_dataset("V", layout)
    with h5py.File(files[2], "w") as file:
        file["V"] = h5py.ExternalLink(other, "V")
    for path in (files[3], folder / "other.nwb"):
        nwb_file(path, unit="kohm", rate=10.0)
    with h5py.File(files[3], "r+") as file:
        del file["acquisition/sensors"]
        file["acquisition/sensors"] = h5py.ExternalLink("other.nwb", "acquisition/sensors")
    return files


def test_nothing_outside_of_an_hdf5_file_is_read(tmp_path):
    for file in outside_hdf(tmp_path):
        for options in ([], ["--rate", "10", "--unit", "counts"]):
            imported = import_files(tmp_path / "out", file, *options)
            assert f"{file.name}: the file names samples outside of it, in " in imported.refused
            assert not imported.raw.exists()


def test_nothing_outside_of_the_folder_of_a_bag_is_read(tmp_path):
    write_bag_2(tmp_path / "run", StoragePlugin.MCAP)
    (inside,) = (tmp_path / "run").glob("*.mcap")
    other = tmp_path / "other"
    other.mkdir()
    (other / "metadata.yaml").write_text((tmp_path / "run/metadata.yaml").read_text())
    (other / inside.name).symlink_to(inside)
    assert "outside of this folder; copy it into it" in import_files(tmp_path, other).refused


@pytest.mark.parametrize(
    ("path", "separator", "options", "written"),
    [
        ("", ",", ["--size", "2.5", "--name", "r07-imported"], "2.5mm/r07-imported.csv"),
        ("", ";", ["--size", "2.5", "--name", "r07-imported"], "2.5mm/r07-imported.csv"),
        ("my files/foreign.csv", "\t", ["--unlabelled"], "unlabelled/foreign.csv"),
    ],
)
def test_a_rejection_leads_on_to_the_import_that_reads_the_file(
    tmp_path, monkeypatch, path, separator, options, written
):
    monkeypatch.chdir(tmp_path)
    file = tmp_path / (path or "raw/2.5mm/r07.csv")
    file.parent.mkdir(parents=True)
    file.write_text(lines(TIME_S, *COUNTS, head="time,S1,S2,S3,S4", sign=separator))
    settings = yaml.safe_load((ROOT / "config/config.yaml").read_text(encoding="utf-8"))
    name = "unlabelled/judged" if path else "2.5mm/r07"
    check, *_ = check_recording(name, file.read_bytes(), 10**6, settings, path)
    line = check["reason"].partition("; if another program wrote it: ")[2]
    *words, last = shlex.split(line)
    assert (words[:2], words[3:], last) == (["capsule", "import"], options, "--dry-run")
    named = [word for word in words[2:] if word not in ("--size", "2.5")]
    imported = import_files(tmp_path, *named, size="2.5")
    assert imported.refused == "" and (imported.raw / written).exists()


def bombs(folder):
    """Write small files that unpack to very much, or are slow to look through."""
    (folder / "text.csv.gz").write_bytes(gzip.compress(bytes(2_000_000)) * 51)
    scipy.io.savemat(folder / "a.mat", {"V": np.zeros((3_000_000, 5))}, do_compression=True)
    with h5py.File(folder / "a.h5", "w") as file:
        for number in range(10):
            file.create_dataset(f"V{number}", (2_000_000,), "f8", chunks=(1000,))
    with zipfile.ZipFile(folder / "a.xlsx", "w", zipfile.ZIP_DEFLATED) as book:
        book.writestr("xl/workbook.xml", bytes(101_000_000))
    write_workbook(folder / "tall.xlsx", {"Run 1": excel_rows(TIME_S.tolist())})
    book = openpyxl.load_workbook(folder / "tall.xlsx")
    book.active.cell(1_048_576, 5).value = 1
    book.save(folder / "tall.xlsx")
    (folder / "lines.txt").write_bytes((b"a b " * 20_000 + b":\n") * 4)
    head = io.BytesIO()
    form = {"descr": "<f8", "fortran_order": False, "shape": (10**10, 5)}
    np.lib.format.write_array_header_1_0(head, form)
    (folder / "a.npy").write_bytes(head.getvalue() + bytes(800))


def test_a_small_file_that_holds_very_much_is_refused_before_it_is_unpacked(tmp_path):
    bombs(tmp_path)
    too_large = "unpacked, it is larger than 100 MB, too large for one"
    reasons = dict.fromkeys(["a.h5", "a.mat", "a.xlsx", "text.csv.gz"], too_large) | {
        "a.npy": "Unable to allocate 373. GiB",
        "lines.txt": "line 3: there is no table with 4 columns",
        "tall.xlsx": "sheet 'Run 1' has 1048576 rows and 5 columns, too many",
    }
    assert reasons.keys() == {path.name for path in tmp_path.iterdir()}
    refused = import_files(tmp_path / "out", *sorted(tmp_path.iterdir())).refused.splitlines()
    for line, (name, reason) in zip(refused, sorted(reasons.items()), strict=True):
        assert f"{name}: " in line and reason in line


def test_a_long_text_takes_little_memory(tmp_path):
    samples = range(60_000)
    rows = "".join(f"{n / 1e3:.3f},{n % 7}.25,{n % 97}.5,{n % 89}.125,7\n" for n in samples)
    path = tmp_path / "long.csv"
    path.write_text(f"time,S1,S2,S3,S4\n{rows}")
    keys = checked_keys({}, SETTINGS)
    tracemalloc.start()
    (table,), _ = read_source(path, keys)
    _, most = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert table.lines.size == 60_000
    assert most < 10 * path.stat().st_size


def test_no_character_of_a_file_moves_the_cursor(tmp_path):
    clear = "\x1b[2J"
    arrays, told = {f"run{clear}/readings": KILO_OHMS}, {(f"run{clear}", "rate"): 10.0}
    write_hdf(tmp_path / "a.h5", arrays, told)
    repeated = np.where(TIME_S == 0.9, 0.8, TIME_S)
    trials = [f"one{clear}"] * 20 + ["two"] * 505
    text = lines(repeated, *COUNTS, trials, head="time,S1,S2,S3,S4,trial")
    (tmp_path / "b.csv").write_text(text)
    (tmp_path / "c.csv").write_text(lines(TIME_S, *COUNTS, head=f"time,a (V{clear}),b,c,d"))
    for name, options, shown in (
        ("a.h5", [], r"variable  run\x1b[2J"),
        ("b.csv", ["--run-column", "trial"], r"run one\x1b[2J: sample 10: time repeats"),
        ("c.csv", [], r"the file names V\x1b[2J of 'a (V\x1b[2J)', no unit of 'b', no unit of 'c'"),
    ):
        imported = import_files(tmp_path, tmp_path / name, *options)
        assert shown in imported.shown + imported.refused
        assert clear not in imported.shown + imported.refused


def test_refused_files_are_not_kept_until_the_last_one(tmp_path):
    rows = [f"{row / 10:.1f},{500 + row % 7},501,502,503" for row in range(3000)]
    text = "\n".join(["time,S1,S2,S3,S4", *rows[:2000], "200.0,5", *rows[2000:]])
    files = [tmp_path / f"{number}.csv" for number in range(6)]
    for file in files:
        file.write_text(text)
    most = []
    for some in (files[:1], files[:1], files):
        tracemalloc.start()
        import_files(tmp_path, *some, "--unit", "counts")
        most.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    # The first import loads modules, too.
    assert most[2] < 2 * most[1]
