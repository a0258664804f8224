"""The whole command: many files, several runs, one file for each sensor, known recordings."""

import hashlib
import os
import re
import shlex

import numpy as np
import pytest
import yaml

from capsule.errors import CapsuleError
from capsule.importing import command
from capsule.recordings.acceptance import check_recording
from support.command import run_command
from support.importing import ODD, SETTINGS, assert_readings, import_files, lines, write_table
from support.lab_files import write_hdf
from support.project import ROOT

pytestmark = pytest.mark.takes(0.1)

TIME_S = np.round(np.arange(200) / 10, 9)
COUNTS = np.rint(500 + 40 * np.sin(2 * np.pi * TIME_S / 3.2 + np.arange(4)[:, None]))
TAKEN = "exists and holds other samples, so it is not overwritten"


@pytest.fixture
def good(tmp_path):
    return write_table(tmp_path / "monday 1.csv", TIME_S, *COUNTS)


def test_a_bad_file_is_a_line_the_others_come_in_and_the_status_tells(
    tmp_path, good, monkeypatch, capsys
):
    monkeypatch.chdir(tmp_path)
    write_table(tmp_path / "monday 2.csv", TIME_S, *COUNTS + 1)
    # The shell has left the pattern.
    given = ODD / "prose.txt", "no*.csv", tmp_path / "monday*.csv", "--size", "2.5"
    assert run_command("import", *given) == 1
    told = capsys.readouterr()
    assert told.out.splitlines()[-1] == "2 recordings imported, 2 files refused"
    assert {path.name for path in tmp_path.glob("raw/2.5mm/*")} == {"monday-1.csv", "monday-2.csv"}
    first, second = told.err.splitlines()
    assert first.startswith(f"refused: {ODD / 'prose.txt'}: line 2: there is no table")
    assert "no*.csv: No such file or directory; give the name of a file that can be" in second
    assert run_command("import", good, "--size", "2.5", "--map", "lab.yaml") == 0


def test_the_header_tells_where_a_recording_is_from(tmp_path, good):
    told = {"adc_bits": "10", "vref_v": "5", "series_ohm": "12000", "site": "wall-3"}
    told |= {"session": "monday", "setup": "gut-2"}
    options = [word for key in told for word in (f"--{key.replace('_', '-')}", told[key])]
    header = import_files(tmp_path, good, *options).the_recording().header
    names = "time = 'time'; sensor_1 = 'S1'; sensor_2 = 'S2'; sensor_3 = 'S3'; sensor_4 = 'S4'"
    told |= {"import_file": "monday 1.csv", "import_columns": names, "unit": "counts"}
    told |= {"import_sha256": hashlib.sha256(good.read_bytes()).hexdigest()}
    told |= {"import_time": "s, a step of 0.1 s is 10 Hz"}
    assert told.items() <= header.items() and "import_resampled" not in header
    assert header["import_unit"].startswith("counts, whole numbers up to 540")
    fast = write_table(tmp_path / "fast.csv", TIME_S / 4, *COUNTS)
    header = import_files(tmp_path / "fast", fast).the_recording().header
    assert header["import_resampled"].startswith("from 40 Hz to 10 Hz, finite impulse response")


def test_what_is_in_the_archive_is_neither_written_again_nor_overwritten(tmp_path, good):
    written = import_files(tmp_path, good).raw / "3mm/monday-1.csv"
    content, copy = written.read_bytes(), tmp_path / "copy of monday.csv"
    copy.write_bytes(good.read_bytes())
    again = import_files(tmp_path, good, copy)
    assert again.counted == "0 recordings imported, 2 already there, 0 files refused"
    assert f"{good}, {copy}: already in the archive: 3mm/monday-1 holds the same" in again.shown
    refused = import_files(tmp_path, good, size="2").refused
    assert "the same content as 3mm/monday-1, under another size: one of the two is" in refused
    write_table(good, TIME_S, *COUNTS + 5)
    assert f"monday-1.csv {TAKEN}; give" in import_files(tmp_path, good).refused
    imported = import_files(tmp_path, good, "--name", "monday-again")
    assert list(imported.recordings()) == ["3mm/monday-1", "3mm/monday-again"]
    assert written.read_bytes() == content


def test_of_two_imports_at_once_the_later_one_is_told(tmp_path, good, monkeypatch):
    write = command.write_new
    monkeypatch.setattr(command, "write_new", lambda *own: [write(own[0], b"other"), write(*own)])
    imported = import_files(tmp_path, good)
    assert f"monday-1.csv {TAKEN}" in imported.refused
    assert (imported.raw / "3mm/monday-1.csv").read_bytes() == b"other"


def test_a_dry_run_of_an_unlabelled_run_writes_nothing_and_shows_the_guess(tmp_path, good):
    imported = import_files(tmp_path, good, "--dry-run", "--unlabelled")
    assert imported.counted == "1 recording would be imported, 0 files refused"
    assert not imported.raw.exists() and not (tmp_path / "lab.yaml").exists()
    # All that is shown stands in docs/import.md.
    assert "would write" in imported.shown and "raw/unlabelled/monday-1.csv" in imported.shown
    assert "time_unit  s  (a step of 0.1 s is 10 Hz)" in imported.shown


def test_an_option_outweighs_the_map_whose_other_keys_hold(tmp_path, good):
    (tmp_path / "my.yaml").write_text(f"missing: [{COUNTS[0, 0]:g}]\nunit: kohm\nsite: wall\n")
    given = good, "--map", tmp_path / "my.yaml", "--unit", "ohm"
    recording = import_files(tmp_path, *given).the_recording()
    assert (recording.header["unit"], recording.header["site"]) == ("ohm", "wall")
    assert np.isnan(recording.values[:, 0]).all() and not np.isnan(recording.values[:, 1]).any()


def test_a_map_is_written_and_one_that_differs_is_left(tmp_path, good):
    path = tmp_path / "lab.yaml"
    assert f"wrote {path}: correct it if it is wrong" in import_files(tmp_path, good).shown
    written = path.read_bytes()
    assert yaml.safe_load(written)["sensors"] == ["S1", "S2", "S3", "S4"]
    other = write_table(tmp_path / "other.csv", TIME_S * 1000, *COUNTS + 9, head="t,a,b,c,d")
    shown = import_files(tmp_path, other).shown
    assert f"{path} exists and differs (time, time_unit, sensors), so it was not changed" in shown
    assert path.read_bytes() == written


def test_runs_are_split_where_a_column_changes_and_written_whole_or_not_at_all(tmp_path):
    values, trials = COUNTS.copy(), np.repeat([1, 2, 1], [70, 60, 70])
    values[1, 150] = np.nan
    path = write_table(tmp_path / "day.csv", TIME_S, trials, *values, head="t,trial,a,b,c,d")
    imported = import_files(tmp_path, path, "--run-column", "trial")
    runs = imported.recordings()
    assert list(runs) == ["3mm/day-1-1", "3mm/day-1-2", "3mm/day-2"]
    assert_readings(runs["3mm/day-2"], TIME_S[:60], COUNTS[:, 70:130])
    # A run tells only its own samples that lack a sensor.
    assert imported.shown.count("1 samples lack a sensor and count as missing") == 1
    assert [np.isnan(run.values).all(axis=0).sum() for run in runs.values()] == [0, 1, 0]
    (tmp_path / "other/raw/3mm").mkdir(parents=True)
    (tmp_path / "other/raw/3mm/day-2.csv").write_bytes(b"other")
    imported = import_files(tmp_path / "other", path, "--run-column", "trial")
    assert f"day-2.csv {TAKEN}" in imported.refused
    assert [each.name for each in imported.raw.glob("*/*")] == ["day-2.csv"]


def test_runs_are_split_at_gaps_and_where_the_clock_starts_again(tmp_path):
    time_s = np.concatenate([TIME_S[:80], TIME_S[80:140] + 30, TIME_S[:60]])
    path = write_table(tmp_path / "day.csv", time_s, *COUNTS)
    runs = import_files(tmp_path, path, "--time", "time", "--run-gap-s", "5").recordings()
    assert list(runs) == ["3mm/day-1", "3mm/day-2", "3mm/day-3"]
    assert_readings(runs["3mm/day-2"], TIME_S[:60], COUNTS[:, 80:140])
    assert runs["3mm/day-2"].header["import_run"] == "2"
    # A run that stands twice in a file is written once.
    path = write_table(tmp_path / "twice.csv", np.tile(TIME_S, 2), *np.tile(COUNTS, 2))
    imported = import_files(tmp_path / "twice", path, "--run-gap-s", "5", "--time", "time")
    assert list(imported.recordings()) == ["3mm/twice-1"]
    assert imported.counted == "1 recording imported, 1 already there, 0 files refused"


@pytest.fixture
def files(tmp_path):
    """Write a file for each sensor, each 0.03 s later."""
    paths = [tmp_path / f"{name}.csv" for name in ("left", "right", "up", "down")]
    times = TIME_S + 0.03 * np.arange(4)[:, None]
    return [write_table(*each, head="t,reading") for each in zip(paths, times, COUNTS, strict=True)]


def test_one_file_a_sensor_on_clocks_of_one_run(tmp_path, files):
    recording = import_files(tmp_path, *files, "--per-sensor").the_recording()
    assert "to the same instants" in recording.header["import_resampled"]
    assert recording.header["import_file"] == "left.csv, right.csv, up.csv, down.csv"
    angles = 2 * np.pi * (recording.time_s + 0.09 - 0.03 * np.arange(4)[:, None]) / 3.2
    exact = 500 + 40 * np.sin(angles + np.arange(4)[:, None])
    np.testing.assert_allclose(recording.values, exact, atol=1)


def test_files_of_sensors_that_do_not_fit_together_or_have_no_name_are_refused(tmp_path, files):
    write_table(files[3], TIME_S + 100, COUNTS[3], head="t,reading")
    refused = import_files(tmp_path, *files, "--per-sensor").refused
    assert "the sensors have no time in common" in refused
    with pytest.raises(CapsuleError, match="per_sensor: 3 files are given"):
        import_files(tmp_path, *files[:3], "--per-sensor")
    path = write_table(tmp_path / "....csv", TIME_S, *COUNTS)
    assert "gives no valid name; give one with --name" in import_files(tmp_path, path).refused


def test_packages_of_the_extra_are_imported_only_by_a_file_that_needs_them():
    files = (ROOT / "workflow/scripts/capsule/importing").glob("*.py")
    text = "".join(path.read_text("utf-8") for path in files)
    assert not re.findall(r"\n(?:import|from) (?:h5py|openpyxl|pynwb|nptdms|pyxdf|rosbags)", text)


def test_lines_of_one_column_with_a_comma_can_be_three_things(tmp_path, files):
    for file in files:
        file.write_text("".join(f"1,{number}\n" for number in range(234, 334)))
    given = [*files, "--per-sensor", "--unit", "V", "--rate", "10"]
    refused = import_files(tmp_path, *given).refused
    assert "left.csv: line 1: '1,234' can be columns, 1 and 234 (--delimiter comma)" in refused
    assert "or 1.234 (--decimal comma) or 1234 (--thousands comma); choose one" in refused
    options = "--decimal", "--thousands", "--time none --sensors 2 --delimiter"
    for option, first in zip(options, (1.234, 1234, 234), strict=True):
        imported = import_files(tmp_path / option, *given, *option.split(), "comma")
        np.testing.assert_array_equal(imported.the_recording().values[:, 0], first)


def test_lab_yaml_keeps_the_order_of_day_and_month_that_was_found(tmp_path):
    for day, known in ((13, []), (4, ["--map", tmp_path / "lab.yaml"])):
        stamps = [f"{day:02}/03/2026 12:00:{second:04.1f}" for second in TIME_S]
        path = write_table(tmp_path / f"day{day}.csv", stamps, *COUNTS + day, head="date,a,b,c,d")
        imported = import_files(tmp_path, path, *known)
    assert imported.refused == ""
    assert imported.recordings()["3mm/day4"].header["started"] == "2026-03-04T12:00:00"


def test_a_question_common_to_many_files_is_asked_once_and_another_one_beside_it(tmp_path):
    volts, clock = COUNTS / 200, [TIME_S, TIME_S]
    same = [write_table(tmp_path / f"{n}.csv", TIME_S, *volts, head="t,a,b,c,d") for n in range(3)]
    other = write_table(tmp_path / "c.csv", *clock, *COUNTS, head="time,clock,S1,S2,S3,S4")
    first, clocks, alike = import_files(tmp_path, same[0], other, *same[1:]).refused.splitlines()
    assert first.startswith(f"refused: {same[0]}: column 'a': readings from ")
    assert "can be V (--unit V) or kohm (--unit kohm); choose one" in first
    assert "the columns 'time', 'clock' can all be the time" in clocks
    assert alike == f"refused: {same[1]}, {same[2]}: the same question as for {same[0]}"


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
            command._tell(text, stream)


def test_the_import_that_a_rejection_names_reads_the_file(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "raw/2.5mm/r07.csv"
    path.parent.mkdir(parents=True)
    path.write_text(lines(TIME_S, *COUNTS, head="time,S1,S2,S3,S4", sign=";"))
    check, *_ = check_recording("2.5mm/r07", path.read_bytes(), 10**6, SETTINGS)
    *words, last = shlex.split(check["reason"].partition("wrote it: capsule ")[2])
    assert last == "--dry-run" and run_command(*words) == 0
    assert path.with_name("r07-imported.csv").exists()


def test_no_character_of_a_file_moves_the_cursor(tmp_path):
    clear = "\x1b[2J"
    told = {(f"run{clear}", "rate"): 10.0}
    write_hdf(tmp_path / "a.h5", {f"run{clear}/readings": COUNTS}, told)
    table = write_table(tmp_path / "c.csv", TIME_S, *COUNTS, head=f"time,a (V{clear}),b,c,d")
    imported = import_files(tmp_path, tmp_path / "a.h5", table)
    assert clear not in imported.shown + imported.refused
    assert r"variable  run\x1b[2J" in imported.shown
    told = r"the file names V\x1b[2J of 'a (V\x1b[2J)', no unit of 'b', no unit of 'c'"
    assert told in imported.refused
