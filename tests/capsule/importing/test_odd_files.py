"""Odd files of laboratories give the right readings, or an error that helps.

All files are in tests/data/odd, and hold the same run of eight samples at 10 Hz.
"""

import re

import numpy as np
import pytest

from support.importing import ODD, assert_readings, import_files

TIME_S = np.arange(8) / 10
COUNTS = np.array(
    [
        [501, 503, 507, 512, 509, 504, 502, 500],
        [611, 612, 610, 605, 601, 598, 603, 607],
        [422, 420, 425, 431, 436, 433, 428, 424],
        [530, 534, 531, 529, 527, 528, 533, 537],
    ],
    dtype=float,
)
VOLTS = np.round(COUNTS * 5 / 1024, 6)
KILO_OHMS = np.round(12 * COUNTS / (1024 - COUNTS), 4)
OHMS = np.round(12_000 * COUNTS / (1024 - COUNTS), 1)


def without(*samples):
    """Return the counts with missing samples."""
    values = COUNTS.copy()
    values[:, samples] = np.nan
    return values


READ = {
    "comma": ("", COUNTS),
    "semicolon": ("", COUNTS),
    "semicolon_points": ("", COUNTS),
    "tab": ("", COUNTS),
    "spaces": ("", COUNTS),
    "bars": ("", COUNTS),
    "units_row": ("", COUNTS),
    "quoted": ("--time 1", COUNTS),
    "quoted_decimal_commas": ("", COUNTS),
    "byte_order_mark": ("", COUNTS),
    "utf16": ("", COUNTS),
    "utf16_unmarked": ("", COUNTS),
    "latin1": ("", COUNTS),
    "percent_comments": ("", COUNTS),
    "savetxt": ("", COUNTS),
    "no_names": ("", COUNTS),
    "crlf": ("", COUNTS),
    "old_mac": ("", COUNTS),
    "trailing_delimiter": ("", COUNTS),
    "preamble": ("", COUNTS),
    "battery": ("", COUNTS),
    "epoch": ("", COUNTS),
    "epoch_seconds": ("", COUNTS),
    "iso": ("", COUNTS),
    "zone": ("", COUNTS),
    "german_dates": ("", COUNTS),
    "slash_dates": ("--date-order day_first", COUNTS),
    "us_dates": ("", COUNTS),
    "am_pm": ("", COUNTS),
    "midnight": ("", COUNTS),
    "sample_numbers": ("--rate 10", COUNTS),
    "steps_of_one": ("--time-unit sample --rate 10", COUNTS),
    "no_time": ("--rate 10", COUNTS),
    "serial_monitor": ("", COUNTS),
    "serial_monitor_own_clock": ("", COUNTS),
    "plotter": ("", COUNTS),
    "plotter_stamped": ("", COUNTS),
    "serial_noise": ("", COUNTS),
    "missing": ("--missing -999", without(3)),
    "missing_sensor": ("", without(5)),
    "missing_at_both_ends": ("", without(0, 7)),
    "three_decimals": ("", COUNTS),
    "date_and_clock": ("", COUNTS),
    "pandas_index": ("", COUNTS),
    "volts": ("", VOLTS),
    "millivolts": ("", COUNTS * 5 / 1000),
    "kilo_ohms": ("", KILO_OHMS),
    "ohms_unnamed": ("", OHMS),
    "volts_unnamed": ("--unit V", np.round(COUNTS * 5 / 1024, 4)),
    "many_counts": ("--unit counts --adc-bits 12", COUNTS * 4),
    "pressure": ("--unit counts", COUNTS),
    "thousands": ("--thousands comma --unit counts", COUNTS * 4),
    "thousands_and_points": ("--unit counts", COUNTS * 4),
    "points_and_commas": ("--unit counts", COUNTS * 4),
    "five_channels": ("--sensors left right up down", COUNTS),
    "sixteen_channels": ("--sensors ch5 ch6 ch7 ch8", COUNTS),
    "two_clocks": ("--time time", COUNTS),
    "wrong_unit": ("--time-unit ms", COUNTS),
    "word_in_a_cell": ("--missing overload", without(2)),
    "counter_and_clock": ("", COUNTS),
    "lab_comments": ("", COUNTS),
}
REFUSED = {
    # file, with options: words of the refusal
    "slash_dates": "'03/04/2026 12:00:00.0' can name the day first (--date-order day_first) or the",
    "sample_numbers": "column 'sample' counts samples; give the sampling rate in Hz with --rate",
    "steps_of_one": "can be ms, 1000 Hz (--time-unit ms) or numbers of samples (--time-unit sample",
    "steps_of_0.4": "can be s, 2.5 Hz (--time-unit s) or ms, 2500 Hz (--time-unit ms)",
    "no_time": "no column gives the time; name one with --time, or give the sampling rate",
    "missing": "column 'S1': readings from -999 to 612 fit no unit; if one of them marks a",
    "volts_unnamed": "can be V (--unit V) or kohm (--unit kohm); choose one",
    "many_counts": "can be counts (--unit counts) or mV (--unit mV) or ohm (--unit ohm)",
    "pressure": "the file names kPa of ",
    "thousands": "line 2: '2,004' can be 2.004 (--decimal comma) or 2004 (--thousands comma)",
    "commas_for_all": "line 2 has 10 cells, but line 1 names 5 columns: a comma seems to be",
    "five_channels": "5 columns can be sensors, 'left', 'right', 'up', 'down', 'middle', and there",
    "sixteen_channels": "16 columns can be sensors, 'ch1', 'ch2', 'ch3', 'ch4', 'ch5', 'ch6'",
    "two_clocks": "the columns 'time', 'timestamp' can all be the time; name one with --time",
    "wrong_unit": "with the unit s (named in the file), its usual step of 100 is a sampling rate",
    "cut_off": "line 9, the last one, has 4 cells, but there are 5 columns; complete the",
    "short_first_line": "line 2 has 3 cells, but there are 5 columns; complete the line, copy",
    "short_line": "line 6 has 4 cells, but there are 5 columns; complete the line, copy",
    "word_in_a_cell": "line 4, column 'S2': 'overload' is not a number; if it marks a",
    "end_line": "line 10, column 'time': 'end' is not a number; if it marks a missing",
    "backwards": "sample 5: time runs backwards, 0 s follows 0.3 s; if another run begins",
    "coarse_clock": "sample 2: time repeats, 0 s follows 0 s; if its clock is too coarse",
    "prose": "line 2: there is no table with 4 columns of numbers",
    "empty": "the file is empty; export it again",
    "three_columns": "3 columns can be sensors, ",
    "no_such_day": "column 'date': '2026-02-30 12:00:00.0' is not a date such as",
    "null_bytes": "the file is not readable text",
    "ampersands": "line 5: there is no table with 4 columns of numbers",
    "comma --delimiter tab": "line 5: there is no table with 4 columns of numbers",
    "comma --sensors 0 1 2 3": "sensors: '0' is not a column; columns 1 to 5 are 'time_s', 'S1'",
    "comma --sensors 1 2 3 4": "column 1 is 'time_s', which holds the time; name the sensors'",
    "battery --sheet Run": "sheet: 'Run' is given, but the file holds one table; leave it",
    "tab --time clock": "time: 'clock' is not a column; columns 1 to 5 are 'time (ms)', 'S1'",
    "semicolon --sensors S1 S2 S3 S1": "column 'S1' is named twice; name another",
    "iso --time-unit clock": "column 'date': '2026-03-04T12:00:00.0Z' is not a time of day",
    "latin1 --encoding utf-8": "the file is not readable text: byte 7 is not utf-8",
    "epoch --encoding utf-16": "line 1: there is no table with 4 columns of numbers",
}
REMEDY = re.compile(
    r"--[a-z]+|delete|export|complete|choose one|allowed|copy|correct|leave|name (each|the|\d)|"
    r"is not a column"
)


@pytest.mark.parametrize("name", READ)
def test_an_odd_file_gives_its_readings_and_by_the_map_the_same_again(tmp_path, name):
    options, values = READ[name]
    file = ODD / f"{name}.txt"
    first = import_files(tmp_path, file, *options.split()).the_recording()
    assert_readings(first, TIME_S, values)
    again = import_files(tmp_path / "again", file, "--map", tmp_path / "lab.yaml").the_recording()
    assert_readings(again, first.time_s, first.values)
    assert again.header["unit"] == first.header["unit"]


@pytest.mark.parametrize("call", REFUSED)
def test_an_odd_file_is_refused_in_words_that_help(tmp_path, call):
    name, *options = call.split()
    imported = import_files(tmp_path, ODD / f"{name}.txt", *options)
    assert f"{name}.txt: " in imported.refused and REFUSED[call] in imported.refused
    assert imported.refused.count("\n") == 1, "a bad file is one line"
    assert REMEDY.search(imported.refused)
    assert (imported.recordings(), imported.status) == ({}, 1)


def test_every_odd_file_is_in_the_table():
    tried = READ.keys() | {call.split()[0] for call in REFUSED}
    assert {path.stem for path in ODD.iterdir()} == tried
