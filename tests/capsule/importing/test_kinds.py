"""Each kind of text gives the right numbers, or a line with a remedy that works.

The kinds are those of public reports of faults of other programs. They are made from one recording
of the shipped archive, with a function a kind; those in tests/data/odd hold a run of eight samples.
"""

import re
from datetime import datetime, timedelta
from itertools import cycle, pairwise

import numpy as np
import pandas
import pytest

from capsule.importing.table import is_far, lone_runs
from capsule.recordings.recording import DECISIVE, Recording, format_recording, read_recording
from support.importing import ODD, Case, import_files, lines, write_table
from support.lab_files import COUNTS, TIME_S
from support.project import ROOT

VOLTS = np.round(COUNTS * 5 / 1024, 5)
# The last reading lacks digits.
SHORTER = VOLTS.copy()
SHORTER[3, -1] = 2.421
# The second one began 2 s later.
LATER = np.array([VOLTS[0, 20:], VOLTS[1, :505], *VOLTS[2:, 20:]])
EACH_TIMED = [each for n, row in enumerate(VOLTS) for each in (TIME_S + 2.0 * (n == 1), row)]
SENSORS = ["S1", "S2", "S3", "S4"]
NOON = datetime(2024, 5, 6, 12)


COUNTED, BY_RATE, RATED = "--unit counts", "--time none --rate 10", "--rate 10"
POINTS, COMMAS = "--unit counts --thousands point", "--thousands comma --unit counts"
V, GAP, RISING = "--unit V", "--run-gap-s 5", "--sensors 1 2 3 4 --rate 10 --unit counts"
PLAIN = lines(TIME_S, *COUNTS)
NO_TIME, NO_NAMES = lines(*COUNTS, head=""), lines(TIME_S, *COUNTS, head="")


def rows(text, case):
    """Return cases by what stands between bars or rows, and by the words before an arrow above."""
    made, words = {}, ""
    for each in re.split(r"\s+\|\s+|\n\s*", text.strip()):
        before, arrow, entry = each.rpartition("=> ")
        words = before.strip() if arrow else words
        made[entry] = case(entry, words)
    return made


def good(text, values=COUNTS, options="", words="", **more):
    """Return a case that is read."""
    return Case(text, words, options=options, values=values, **more)


def above(line, table=PLAIN):
    """Return a table with a line above it."""
    return f"{line}\n{table}"


def named(names, values=COUNTS, sign=","):
    """Return the table with other names; `{}` in one name stands for the number of the sensor."""
    if "{}" in names:
        names = sign.join(names.format(number) for number in range(1, 5))
    return lines(TIME_S, *values, head=f"time_s{sign}{names}", sign=sign)


def timed(name, times, values=COUNTS):
    """Return the table with other times, and the name of their column."""
    return lines(times, *values, head=f"{name},S1,S2,S3,S4")


def ticks(name, per_second):
    return timed(name, np.rint(TIME_S * per_second))


def grouped(scale, form, names="S1;S2;S3;S4", times="{:g}".format):
    """Return the counts in groups of three digits, which a mark parts; and times in ms."""
    rows = [[form(value) for value in scale * row] for row in COUNTS]
    return lines([*map(times, 1000 * TIME_S)], *rows, head=f"ms;{names}", sign=";")


def wrapped(bits, per_second, *, scale=1, low=0):
    """Return times of a counter of some bits that begins again at the 201st sample."""
    ticks = np.rint(TIME_S * per_second).astype(int) - round(20 * per_second) + 2**bits + low
    return ((ticks - low) % 2**bits + low) / scale


def moments(form, first=NOON):
    """Return what a form makes of the moment of each sample."""
    return [form(first + timedelta(seconds=second)) for second in TIME_S]


def stamped(form, between):
    rows = lines(*COUNTS, head="").splitlines()
    pairs = zip(moments(form), rows, strict=True)
    return "".join(f"{stamp}{between}{row}\r\n" for stamp, row in pairs)


def clock(moment):
    return f"{moment:%H:%M:%S.%f}"[:-3]


def millis(moment):
    return moment.isoformat(" ", "milliseconds")


def autumn(back_s=3600):
    """Return local times over the end of summer time, or its begin."""
    first = datetime(2025, 10, 26, 2, 59, 30)
    times = [millis(first + timedelta(seconds=s - back_s * (s >= 29.95))) for s in TIME_S]
    return lines(times, *COUNTS, head="date,S1,S2,S3,S4")


def german(value):
    return f"{value:,.0f}".replace(",", ".")


def lvm(x_columns="One", unit=False, later_s=0.0):
    """Return a file of LabVIEW; the second channel can begin later."""
    own = x_columns == "Multi"
    said = {"Samples": ["525"] * 4, "Date": ["2024/05/06"] * 4, "Time": ["09:00:00,0"] * 4}
    said |= {"Y_Unit_Label": ["Volts"] * 4} if unit else {}
    said |= {"X0": ["0,0E+0", f"{later_s}", "0,0E+0", "0,0E+0"], "Delta_X": ["0,100000"] * 4}
    said["***End_of_Header***"] = [""] * 4
    head = "LabVIEW Measurement\t\r\nDecimal_Separator\t,\r\n***End_of_Header***\t\r\n\t\r\n"
    head += "Channels\t4\t\t\t\t\r\n"
    for name, cells in said.items():
        head += "\t".join([name, ("\t\t" if own else "\t").join(cells), "\r\n"])
    names = ("\tX_Value\t" if own else "\t").join(SENSORS)
    pairs = [(TIME_S + later_s * (n == 1), row) for n, row in enumerate(VOLTS)]
    alone = [[""] * 525 if x_columns == "No" else TIME_S, *VOLTS]
    columns = [each for pair in pairs for each in pair] if own else alone
    head += f"X_Value\t{names}\tComment\r\n"
    return (head + lines(*columns, head="", sign="\t")).replace(".", ",")


def labchart(*blocks):
    text = ""
    for block in blocks:
        text += "Interval=\t0.1 s\nTimeFormat=\tStartOfBlock\n"
        text += "ChannelTitle=\tS1\tS2\tS3\tS4\nRange=" + "\t10.000 V" * 4 + "\n"
        times = TIME_S[block] - TIME_S[block][0]
        text += lines(times, *VOLTS[:, block], head="", sign="\t")
    return text


EIGHT = np.loadtxt(ODD / "comma.txt", delimiter=",", skiprows=1).T[1:]


def without(*samples):
    """Return the eight samples with missing samples."""
    return np.where(np.isin(np.arange(8), samples), np.nan, EIGHT)


FOUR, EIGHT_VOLTS = EIGHT * 4, np.round(EIGHT * 5 / 1024, 4)
PLAIN_FILES = """
    comma semicolon semicolon_points tab spaces bars units_row quoted_decimal_commas
    byte_order_mark utf16 utf16_unmarked latin1 percent_comments savetxt no_names crlf old_mac
    trailing_delimiter preamble battery epoch epoch_seconds iso zone german_dates us_dates am_pm
    midnight serial_monitor serial_monitor_own_clock plotter plotter_stamped serial_noise
    three_decimals date_and_clock pandas_index counter_and_clock lab_comments
"""
# Files of tests/data/odd: the options that read them, what is read, and the refusal without them.
ODD_READ = dict.fromkeys(PLAIN_FILES.split(), ("", EIGHT, "")) | {
    "missing_sensor": ("", without(5), ""),
    "missing_at_both_ends": ("", without(0, 7), ""),
    "volts": ("", np.round(EIGHT * 5 / 1024, 6), ""),
    "millivolts": ("", EIGHT * 5 / 1000, ""),
    "kilo_ohms": ("", np.round(12 * EIGHT / (1024 - EIGHT), 4), ""),
    "ohms_unnamed": ("", np.round(12_000 * EIGHT / (1024 - EIGHT), 1), ""),
    "quoted": ("--time 1", EIGHT, ""),
    "thousands_and_points": ("--unit counts", FOUR, ""),
    "points_and_commas": ("--unit counts", FOUR, ""),
    "slash_dates": ("--date-order day_first", EIGHT, "12:00:00.0' can name the day first (--date"),
    "sample_numbers": ("--rate 10", EIGHT, "column 'sample' counts samples; give the sampling"),
    "steps_of_one": ("--rate 10 --time-unit sample", EIGHT, "ms) or numbers of samples (--time"),
    "no_time": ("--rate 10", EIGHT, "no column gives the time; name one with --time, or give the"),
    "missing": ("--missing -999", without(3), "column 'S1': readings from -999 to 612 fit no unit"),
    "volts_unnamed": ("--unit V", EIGHT_VOLTS, "can be V (--unit V) or kohm (--unit kohm)"),
    "many_counts": ("--adc-bits 12 --unit counts", FOUR, "can be counts (--unit counts) or mV ("),
    "pressure": ("--unit counts", EIGHT, "the file names kPa of "),
    "thousands": (COMMAS, FOUR, "2.004 (--decimal comma) or 2004 (--thousands comma)"),
    "five_channels": ("--sensors left right up down", EIGHT, "5 columns can be sensors, 'left', "),
    "sixteen_channels": ("--sensors ch5 ch6 ch7 ch8", EIGHT, "16 columns can be sensors, 'ch1'"),
    "two_clocks": ("--time time", EIGHT, "the columns 'time', 'timestamp' can all be the time"),
    "wrong_unit": ("--time-unit ms", EIGHT, "with the unit s (named in the file), its usual step"),
    "word_in_a_cell": ("--missing overload", without(2), "line 4, column 'S2': 'overload' is not"),
}
# Files with options that do not read them, and words of the refusal.
ODD_REFUSED = {
    "steps_of_0.4": "can be s, 2.5 Hz (--time-unit s) or ms, 2500 Hz (--time-unit ms)",
    "commas_for_all": "line 2 has 10 cells, but line 1 names 5 columns: a comma seems to be",
    "cut_off": "line 9, the last one, has 4 cells, but there are 5 columns; complete the",
    "short_first_line": "line 2 has 3 cells, but there are 5 columns; complete the line, copy",
    "short_line": "line 6 has 4 cells, but there are 5 columns; complete the line, copy",
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
# Lines above a table that change nothing.
READ_ABOVE = """
    # time base: 10 us | # dt: 100 | # inflated to 20 kPa | # operator: N
    # clock: 16 MHz | # step 3 | # calibrated: yes | # calibrated: 2026-03-04 | # baseline: 10 s
    # resolution: 10 bit | # 12 kohm in series | # supply (V): 5 | # gain: 1 | # offset: 0
    # scale_factor: 1.0
"""
# Names of sensors that hold no unit, or ohm.
READ_NAMED = """
    S{}_\u03a9 | S{} in \u2126 | S (left),S (right),S (up),S (down) | N,E,S,W | S1_L,S2_R,S3_T,S4_B
    T{} | A,B,C,D | in_{} | gain{} | left index 1,left index 2,S_min 3,S_min 4 | 0,1,2,3
"""
# Lines above a table without times.
READ_RATES = """
    # fs: 10 | % Sampling rate (kHz) = 0.01 | sample_rate,10 Hz | # fs_khz: 0,01 | # dt_ms: 100
    # Sample Interval: 100 ms
"""
MILLIVOLTS = {
    "words for millivolts": named("P{} (mVolt)"),
    "millivolts of a multimeter": named("P{} (mVDC)"),
    "comment in millivolts": above("# Units: mV"),
    "two words for one unit": above("# unit: mV\n# Units: millivolts"),
    "unit of each sensor": above("# S1: mV\n# S2 in mV\n# channels 3 to 4: mV"),
    "words in a comment": above("# all readings in millivolts"),
    "row of units": lines(TIME_S, *COUNTS, head="time,S1,S2,S3,S4\ns,mV,mV,mV,mV"),
}
# As a serial plotter shows it.
LABELS = [[f"{n}:{x:g}" for x in row] for n, row in zip(SENSORS, COUNTS, strict=True)]
LABELLED = lines(*LABELS, head="", sign=" ")
# Counters of so many bits in a unit of time, from the lowest value on.
COUNTERS = [("us", 32, 1e6, 0), ("us", 32, 1e6, -(2**31)), ("ms", 31, 1e3, 0), ("ms", 16, 1e3, 0)]
COUNTERS += [("ms", 16, 1e3, -(2**15)), ("ms", 15, 1e3, 0)]
# Stamps that a terminal writes before each line, and what it writes between.
STAMPS = {
    "CoolTerm": (millis, " "),
    "Tera Term": (lambda moment: f"[{millis(moment)}]", " "),
    "grabserial": (lambda moment: f"[{moment:%a %b %d %H:%M:%S.%f %Y}]", " "),
    "grabserial, s": (lambda moment: f"[{(moment - NOON).total_seconds():.6f} 0.100000]", " "),
    "a level": (lambda moment: f"[{(moment - NOON).total_seconds():12.6f}]", " <inf> adc: "),
    "colon": (clock, ": "),
    "arrow": (clock, " > "),
    "brackets": (lambda moment: f"({clock(moment)}", ") "),
    "a word": (clock, " INFO "),
}
# Names of a time for each sensor.
EACH_NAMES = """
    time,S1,time,S2,time,S3,time,S4 | time,S1,time.1,S2,time.2,S3,time.3,S4
    t1,S1,t2,S2,t3,S3,t4,S4 | S1 time,S1,S2 time,S2,S3 time,S3,S4 time,S4
"""
PAST_HOUR = moments(lambda moment: f"{moment:%M:%S.%f}"[:7], datetime(2024, 5, 6, 9, 59, 40))
# As a spreadsheet writes elapsed times.
PAST_DAY = [f"23:59:{s + 50:04.1f}" if s < 10 else f"24:00:{s - 10:04.1f}" for s in TIME_S]
PAUSED = TIME_S + 300 * (TIME_S > 20)
TRUNCATED = np.where(TIME_S > 0, TIME_S + 20, 0)
STUCK = np.array([*COUNTS[:2], 7 + 0 * TIME_S, COUNTS[3]])
TABBED = lines(TIME_S, *COUNTS, head="TIME:\t1\t2\t3\t4", sign="\t")
EMPTY_QUOTES = lines(TIME_S, *COUNTS, head="t a b c d", sign=" ").replace("\n4 ", '\n4 "" ')
EMPTY_QUOTES = EMPTY_QUOTES.replace(f"{COUNTS[3, 40]:g}\n4.1 ", "\n4.1 ")
HELD_FIRST = np.where((COUNTS[0, 0] == COUNTS).any(axis=0), np.nan, COUNTS)
HOUR = "jumps by an hour, as with summer time"
MICROS = timed("t (s)", wrapped(32, 1e6, scale=1e6))
PART = timed("time_s", [f"{second + 18.3:.3f}" for second in TIME_S])
BY_PANDAS, FIVE = pandas.DataFrame(COUNTS.T, index=TIME_S).to_csv(), "--time 1 --sensors 2 3 4 5"
OWN = {"source": "simulated phantom", "simulator_seed": "7", "adc_bits": "10"}
START = ["start", *[""] * 524]
BY_24, MARKS = grouped(24, "{:,.0f}".format), " \u00a0\u2009'"
FIRST_OVER = "line 1, '469,497,532,540', is passed over"
CUT_TIME = lines(TIME_S + 20, *COUNTS, head="")[1:]
FAR_FIRST = "20.1 s lie between the first two samples; if the first line lacks digits"
FILL, SCALED = f"# fill value: {COUNTS[0, 0]:g}", "# scale factor: 0.1"
LOST = np.where(TIME_S == 4, np.nan, COUNTS)
BACKWARDS = ("S4,S3,S2,S1", "S4, S3, S2, S1", "5,4,3,2")
CUT_LOG = f"ready\n{LABELLED}S1:5\n"
PASSED_OVER = {"import_passed_over": "2 lines without a whole sample"}
TWICE = "# session: monday\n# session: monday"
CUT_BOTH = lines(*VOLTS, head="")[1:-3]
CUT_NOTE = "1, with 0.29004, 2.42676, 2.59766, 2.63672, is passed over: 0.29004 is far from"
ONE_FAR = np.where(np.outer([0, 0, 1, 0], TIME_S == 10), 5, COUNTS)
TWO_FAR = np.where(np.outer([0, 0, 1, 0], TIME_S == 10.1), 53, ONE_FAR)[:, :120]
LAST_FAR = np.where(np.outer([0, 0, 0, 1], TIME_S == 52.4), COUNTS // 100, COUNTS)
ONE_FAR_TOLD = f"note: line 102: 5 of sensor_3 is far from {COUNTS[2, 99]:g} before and "
ONE_FAR_TOLD += f"{COUNTS[2, 101]:g} after it"
LAST_FAR_TOLD = f"line 526: 4 of sensor_4 is far from {COUNTS[3, -2]:g} before"
FAR_NUMBER = f"{NO_TIME[2]}, 497, 532, 540, is passed over: {NO_TIME[2]} is far from"
READ = {
    **rows(READ_ABOVE, lambda line, _: good(above(line))),
    **rows(READ_NAMED, lambda names, _: good(named(names))),
    **rows(READ_RATES, lambda line, _: good(above(line, lines(*COUNTS, head="S1,S2,S3,S4")))),
    **{kind: good(text, COUNTS / 1000) for kind, text in MILLIVOLTS.items()},
    **{
        f"{bits} bits from {low} {unit}": good(
            timed(f"t ({unit})", wrapped(bits, hertz, low=low)), words="the clock jumps by "
        )
        for unit, bits, hertz, low in COUNTERS
    },
    "micros() in seconds": good(MICROS, words="the clock jumps by 4294.967296"),
    "autumn": good(autumn(), words=HOUR),
    "spring": good(autumn(-3600), words=HOUR),
    "no hours": good(timed("t", PAST_HOUR)),
    "past 24 h": good(timed("t", PAST_DAY)),
    "one of a unit": good(above("# time base: 1 ms", ticks("time", 1000))),
    # Kills: decimals of a time as thousands.
    "a part of a longer run": good(above("# unit: counts", PART)),
    **{f"stamps, {kind}": good(stamped(*how)) for kind, how in STAMPS.items()},
    "numbers name columns": good(timed("Time", TIME_S).replace("S", "")),
    "remark on the first sample": good(TABBED.replace("\n0.1\t", "\tswallow 1\n0.1\t")),
    "numbers of pandas": good(BY_PANDAS, COUNTS, FIVE, "line 1, with 0, 1, 2, 3, is passed over"),
    "a remark behind the first sample": good(lines(TIME_S, *COUNTS, START, head="")),
    **{
        f"{m!r} in thousands": good(BY_24.replace(",", m), 24 * COUNTS, COUNTED, "use --adc-bits")
        for m in MARKS
    },
    "counts of 16 bits": good(BY_24.replace(",", ""), 24 * COUNTS, f"{COUNTED} --adc-bits 16"),
    # What is simulated stays called simulated.
    "a recording": good(format_recording(Recording(TIME_S, COUNTS, OWN)).decode(), header=OWN),
    "first line without its time": good(NO_NAMES[2:], COUNTS[:, 1:], "", FIRST_OVER),
    "first time that lacks digits": good(CUT_TIME, words=FAR_FIRST, time_s=TRUNCATED),
    "a long gap": good(timed("t", PAUSED), words="5 min follows sample 201", time_s=PAUSED),
    "a stuck sensor": good(timed("t", TIME_S, STUCK), STUCK, "", "reject it: sensor_3 reads 7 in"),
    "a mark of missing samples in a comment": good(above(FILL), HELD_FIRST, "", "lack a sensor"),
    "a scaling in a comment": good(above(SCALED), COUNTS, COUNTED, "0.1; that is not applied"),
    "an empty cell in quotes": good(EMPTY_QUOTES, LOST, "", "1 samples lack a sensor and count"),
    "a rising sensor": good(NO_NAMES, np.vstack([TIME_S, COUNTS[:3]]), RISING, "sensor_1 rises"),
    **{f"sensors {each}": good(PLAIN, COUNTS[::-1], f"--sensors {each}") for each in BACKWARDS},
    "a broken line at the end of a log": good(CUT_LOG, options=RATED, header=PASSED_OVER),
    "a line of the header that stands twice": good(above(TWICE), header={"session": "monday"}),
    "LabVIEW": good(lvm(), VOLTS, V, "volts are judged as they are; use --vref-v"),
    "LabVIEW, no times": good(lvm("No"), VOLTS, f"{V} --vref-v 5"),
    "LabVIEW, a time for each": good(lvm("Multi", unit=True), VOLTS),
    "LabVIEW, the second channel later": good(lvm("Multi", unit=True, later_s=2.0), LATER),
    "LabVIEW, no times, later": good(lvm("No", unit=True, later_s=2.0), LATER),
    **rows(EACH_NAMES, lambda names, _: good(lines(*EACH_TIMED, head=names), LATER, V)),
    "LabChart": good(labchart(slice(None)).replace("\n20\t", "\t#* wave 2\n20\t"), VOLTS),
    "whole last number without a line end": good(PLAIN.rstrip("\n")),
    "decimals without a last line end": good(lines(TIME_S, *VOLTS).rstrip("\n"), VOLTS, V),
    "lines cut at both ends": good(CUT_BOTH, SHORTER[:, 1:], f"{RATED} {V}", CUT_NOTE),
    "last number that may lack digits": good(lines(TIME_S, *VOLTS)[:-3], SHORTER, V, "'2.421' may"),
    "first line that lacks digits": good(NO_TIME[2:], COUNTS[:, 1:], RATED, FAR_NUMBER),
    "a reading that lacks digits": good(lines(TIME_S, *ONE_FAR), ONE_FAR, "", ONE_FAR_TOLD),
    "two readings that lack digits": good(
        lines(TIME_S[:120], *TWO_FAR), TWO_FAR, "", "line 103: 5 and 53 of sensor_3 is far from "
    ),
    "a last reading that lacks digits": good(lines(TIME_S, *LAST_FAR), LAST_FAR, "", LAST_FAR_TOLD),
    **{
        name: good(ODD / f"{name}.txt", values, said)
        for name, (said, values, _) in ODD_READ.items()
    },
}


@pytest.mark.parametrize("kind", READ)
def test_a_kind_of_file_gives_the_right_numbers_and_by_the_map_again(tmp_path, kind):
    row = READ[kind]
    imported = row.check_read(tmp_path)
    assert imported.shown.count("is far from") == row.words.count("is far from")
    options = "--map", tmp_path / "lab.yaml"
    again = import_files(tmp_path / "again", row.written(tmp_path), *options)
    row.check(again)
    assert again.the_recording().header["unit"] == imported.the_recording().header["unit"]


def repeated(*columns, head):
    """Return a table whose names are written again where the board starts again."""
    parts = [[column[part] for column in columns] for part in (FIRST, REST)]
    return "".join(lines(*part, head=head) for part in parts)


FIRST, REST = slice(300), slice(300, None)
# Lines above a table, behind the unit that the refusal names.
UNITS_ABOVE = """
    kPa => # unit: kPa | Units: kPa | # pressure (kPa) | # readings: kPa | // kPa | kPa
    Vertical Units,kPa | mmHg => % unit mmHg | nT => # signals in nT
    N => # Force [N] | # s;N;N;N;N | # all N | # S1..S4 N | # S1-S4: N
    grams-force => # values in grams-force
"""
# Those that the refusal quotes: units in words, scales, and scales in words.
QUOTED = """
    # column 2: pressure [kPa] | # {"unit": "kPa", "fs": 10} | # values are mV
    # field in microtesla | # readings in grams force | REM all in mmHg | # scale_factor: 0.001
    Offset,-2 | # mV_per_lsb: 4.88 | mV/count,4.88 | # gain: 10 | # calib_slope: 2.2
    # counts_per_V: 204.8 | # YScale: 0.5 | # values x 10 | # 0.1 mV per count | # scaled by 0.001
    # readings are 10 * counts | # 1 LSB = 4.88 mV | # supplied by 5 V, with a gain of 2
    # S1 in mV | # S2..S4: kPa | # channel 1: mV
    # k: 0.5 | # a1: 10 | # k = 0.5 N/V | PGA 16 | # resolution 0.5
"""
# Names of sensors, behind what the refusal names of the first and all others.
UNITS_IN_NAMES = """
    uV => P{} (uV) | mmHg => P{} (mmHg) | gf => P{} (gf) | cmH2O => P{} (cmH2O)
    N/mm2 => P{} (N/mm2) | % => S{} % | percent => S{}_percent | N => S{}_N | S{} in N
    cN => S{}, cN | g => S{}/g | uS => S{}_uS | T => S{}_T | G => S{} G | *10 => S{} *10
    mV_x10 => S{}_mV_x10 | microstrain => S{}_microstrain | l/min => S{} / l/min
    kPa => pressure kPa {} | in 0.1 mV => S{} in 0.1 mV
    a scaling => S{}_V_gain10 | S{} x10 (V) | 10*S{}
"""
QUOTED_NAMES = "P{}kPa | S{} (kPa) filtered | S{} kPa (raw) | kg_{} | force_N_{}"
# Names of a time in a unit that is none of the list, and lines above a table, behind the unit and
# the ticks per second.
TIME_UNITS = """
    1/100 s, 100 => Time (1/100 s) | cs, 100 => time_cs | ticks, 1e7 => t [ticks] | ticks
    0.1 ms, 1e4 => time (0.1 ms) | hundredths, 100 => time_hundredths
    10 us, 1e5 => time_10 us | time in 10 us | t (10 us) | us_x10, 1e5 => time_us_x10
    us)/10, 1e5 => time (us)/10 | filetime, 1e7 => filetime | pts, 90000 => pts
    cs, 100 => # x-axis unit: cs | # column 1: time [cs] | # {"time_unit": "cs"}
    # first column in cs | 1/256 s, 256 => # time is in 1/256 s
    10 us, 1e5 => # Time base: 10 us | # time in units of 10 us
    ticks, 100 => # t: ticks, S1-S4: counts | centiseconds, 100 => # times are centiseconds
    100 ns, 1e7 => # timestamps in units of 100 ns | 0.1 ms, 1e4 => # time resolution 0.1 ms
    time_scale: 0.01, 100 => # time_scale: 0.01 | 250 kHz, 250e3 => # timer: 250 kHz
    clock_hz: 32768, 32768 => # clock_hz: 32768 | timer: 4 us, 250e3 => # timer: 4 us
    250,000, 250e3 => # ticks_per_s: 250,000
    a second, 100 => # counted in hundredths of a second
"""
# Lines above a table with rates that contradict its times.
OTHER_RATES = """
    sampling rate = 20 => # sampling rate = 20 Hz
    1 / Sampling interval = 5 => # Sampling interval (ms): 200
    1 / Sample Interval = 5 => Sample Interval,0.2,s | 1 / dt = 5 => # dt_ms: 200
    fs = 5 => # fs: 5 samples per second | Acquisition rate = 5 => # Acquisition rate = 5.0e0 Hz
    rate = 5 and another rate = 10 => # rate: 10, 10, 10, 5
"""
# Times without a unit, by what their step is in s.
BARE_TIMES = {"0.01": 1e2, "0.0001": 1e4, "1e-05": 1e5, "1e-07": 1e7, "0.02": 50}
BARE_TIMES |= {"0.0009766": 1024, "3.052e-05": 32_768}
JUMPED = TIME_S + 200_000 * (TIME_S == 30)
SECONDS, MINUTES = timed("time", TIME_S), timed("time", TIME_S / 60)
MICRO_MILLI = above("# time unit: ms", ticks("time_us", 1e5))
TICKS_1601 = timed("timestamp", [f"{133 * 10**15 + round(second * 1e7)}" for second in TIME_S])
ALL_POINTS = grouped(4, german, times=german)
BY_20, BY_2, BY_4 = grouped(20, german), grouped(2, german), grouped(4, "{:,.0f}".format)
RAW = above("# unit: kPa", named("S{}_raw"))
NAMED_AGAIN = repeated(*COUNTS, head="S1,S2,S3,S4")
OVER_ALL = timed("time,Pressure (kPa),,,\ns", TIME_S)
DATED = above("# rate: 20 Hz", timed("t", moments(clock)))
GAIN_LOG = above("gain: 10", LABELLED)
GAINS = lines(TIME_S, *COUNTS, [10.0] * 525, head="time,S1,S2,S3,S4,gain")
UNITS = lines(TIME_S, *COUNTS, ["kPa"] * 525, head="time,S1,S2,S3,S4,units")
CONVERTED = above("# converted to kPa", named("P{} (counts)"))
STAMPS_ALONE = "".join(f"12:34:{second} -> \n" for second in range(10, 60))
BROKEN = f"ready\nS1:5\n{LABELLED}S1:5\n{LABELLED}"
TWO_CLOCKS = lines(TIME_S, TIME_S, *VOLTS, head="time,clock,a,b,c,d")
MM_HG = "time,P1,P2,P3,P4\ns,mmHg,mmHg,mmHg,mmHg"
# What is said to German counts with a point, by the options before.
THOUSANDFOLD = {
    COUNTED: "can be 1.002 (--decimal point) or 1002 (--thousands point); choose one",
    "--decimal point": "from 1 to 998 can be mV (--unit mV) or kohm (--unit kohm)",
    "--decimal point --unit counts": "'1.002' beside 938 is no count; use --thousands",
}


def unknown_unit(text, what):
    """Return the case of a time in a unit that the import does not know, by its name or a line."""
    unit, _, per_second = what.rpartition(", ")
    is_line = text.startswith("#")
    table = ticks("time" if is_line else text, float(per_second))
    return Case(above(text, table) if is_line else table, f"{unit}', which is none of", BY_RATE)


def quoted(line, _):
    return Case(above(line), re.sub(",(?=[-0-9])", ": ", line.strip("# ")), COUNTED)


def unit_in_names(names, unit):
    return Case(named(names, sign=";"), f"names {unit} of {names.format(1)!r} and all", COUNTED)


def solid(form):
    """Return the case of a clock without colons."""
    times = moments(lambda moment: f"{moment:{form}}"[:-5], NOON - timedelta(seconds=20))
    return Case(timed("time", times), "clock without colons", BY_RATE)


def twice(key):
    text = above(f"# {key}: 1\n# bench: 2\n# bench: 3\n# {key}: 4")
    return Case(text, f"lines 1 and 4 name two values of {key}, '1' and '4'; delete")


GERMAN_NAMED = grouped(4, german, "S1 (counts);S2 (counts);S3 (counts);S4 (counts)")
RESET = repeated(np.concatenate([TIME_S[:300], TIME_S[:225]]), *COUNTS, head="time_s,S1,S2,S3,S4")
RECORDED = above("# format_version: 1\n# S1: mV")
ASKED = {
    **rows(UNITS_ABOVE, lambda line, unit: Case(above(line), f"names {unit} of ", COUNTED)),
    **rows(QUOTED, quoted),
    "unit of a sensor in a recording": Case(RECORDED, "says 'S1: mV', and not", COUNTED),
    "two units above": Case(above("# unit: counts\n# in kPa"), "names counts and kPa of", COUNTED),
    **rows(UNITS_IN_NAMES, unit_in_names),
    **rows(QUOTED_NAMES, lambda n, _: Case(named(n), f"says {n.format(1)!r}, and of no", COUNTED)),
    "unit for a name": Case(named("kPa,kPa,kPa,kPa"), "names kPa of ", COUNTED),
    **rows(TIME_UNITS, unknown_unit),
    "too short": Case(above("# time in ms", SECONDS), "1e+04 Hz, too much for", "--time-unit s"),
    "another unit of time": Case(above("x: ms", SECONDS), "says 'ms', and", "--time-unit s"),
    **{
        f"steps of {step}": Case(ticks("time", hz), f"of {step} s, 10 Hz ({BY_RATE})", BY_RATE)
        for step, hz in BARE_TIMES.items()
    },
    "times in minutes": Case(MINUTES, "or min, 10 Hz (--time-unit min)", "--time-unit min"),
    "two units of time": Case(MICRO_MILLI, "the file names us and ms; give", BY_RATE),
    **rows(
        OTHER_RATES,
        lambda line, rates: Case(above(line), f"but the file states {rates}; g", "--time-unit s"),
    ),
    "rate beside dates": Case(DATED, "rate = 20; give --time-unit clock", "--time-unit clock"),
    "scale in a log": Case(GAIN_LOG, "says 'gain: 10', and", f"{RATED} {COUNTED}"),
    "scale in a column": Case(GAINS, "says 'gain: 10', and not", COUNTED),
    "unit over several columns": Case(OVER_ALL, "says 'Pressure (kPa)'", COUNTED),
    "words beside a unit": Case(CONVERTED, "names counts and says 'converted to kPa'", COUNTED),
    "two units": Case(RAW, "names raw and says 'unit: kPa'", COUNTED),
    "unit in a column": Case(UNITS, "names kPa of 'S1'", COUNTED),
    "unit in the name of a file": Case(
        lambda folder: write_table(folder / "run_mmHg.csv", TIME_S, *COUNTS),
        "says 'its name: run mmHg'",
        COUNTED,
    ),
    "unit in a row": Case(lines(TIME_S, *COUNTS, head=MM_HG), "names mmHg of 'P1'", COUNTED),
    **{f"a clock without colons, {form}": solid(form) for form in ("%H%M%S.%f", "%Y%m%d%H%M%S.%f")},
    "ticks since 1601": Case(TICKS_1601, "1e+06 is a rate between", "--rate 10 --time none"),
    "all with points": Case(ALL_POINTS, "1.876 (--decimal point) or", POINTS, COUNTED, 4 * COUNTS),
    "counts with points": Case(GERMAN_NAMED, "from 1.692 to 2.164 are", POINTS, "", 4 * COUNTS),
    "numbers with points": Case(BY_20, "9.38 (--decimal point) or 9380", POINTS, "", 20 * COUNTS),
    **{
        f"decimals that jump, {said}": Case(BY_2, words, POINTS, said, 2 * COUNTS)
        for said, words in THOUSANDFOLD.items()
    },
    "commas and the unit": Case(BY_4, "with --decimal comma, column 'S1'", COMMAS, "", 4 * COUNTS),
    "time in whole seconds": Case(timed("time_s", TIME_S // 1), "does not run forward", BY_RATE),
    "a time that jumps": Case(timed("time_s", JUMPED), "sample 302: time runs backwards", BY_RATE),
    "names repeated by a reset": Case(RESET, "0 s follows 29.9 s; if another", GAP, values=None),
    "names again": Case(NAMED_AGAIN, "above line 303 the", f"{RATED} {GAP}", RATED, None),
    "blocks of LabChart": Case(labchart(FIRST, REST), f"give {GAP}", GAP, values=None),
    "last line that lacks a digit": Case(PLAIN[:-2], "line 526 is cut off"),
    "last reading lost behind its delimiter": Case(PLAIN[:-4], "line 526 is cut off"),
    **{
        name: Case(ODD / f"{name}.txt", words, remedy, values=values)
        for name, (remedy, values, words) in ODD_READ.items()
        if words
    },
    **{
        call: Case(ODD / f"{call.split()[0]}.txt", words, options=call.partition(" ")[2])
        for call, words in ODD_REFUSED.items()
    },
    # Whatever the reader of recordings takes one value of, the import does.
    **{f"two values of {key}": twice(key) for key in (*DECISIVE, "session")},
    "a log of stamps alone": Case(STAMPS_ALONE, "line 1: there is no table"),
    "a broken line": Case(BROKEN, "line 528 does not hold a whole sample", options=RATED),
    "all at once": Case(TWO_CLOCKS, "with --time; and column 'a'", f"--time time {V}", "", VOLTS),
}


@pytest.mark.parametrize("kind", ASKED)
def test_a_kind_of_file_is_asked_about_and_the_remedy_works(tmp_path, kind):
    ASKED[kind].check_asked(tmp_path)


def test_every_odd_file_is_in_the_table():
    tried = ODD_READ.keys() | {call.split()[0] for call in ODD_REFUSED}
    assert {path.stem for path in ODD.iterdir()} == tried


def test_nothing_is_named_in_the_recordings_of_the_archive():
    files = sorted(ROOT.glob("raw/*mm/*.csv"))
    assert len(files) > 100
    for path in files:
        with path.open("rb") as stream:
            values = read_recording(stream, 4).values
        assert not lone_runs(values) and not is_far(values).all(), path


STARTED, NO_DATE = "# started: {0:%Y-%m-%dT%H:%M:%S}Z\n", "which is no date such as"


@pytest.mark.parametrize(
    ("heads", "told"),
    [
        ([STARTED], ""),
        (["# Start Time: {0:%Y-%m-%d %H:%M:%S}\n"], ""),
        (["# t0 = {0:%S} s\n"], ""),
        (["# Date: {0:%Y-%m-%d}\n# Time: {0:%H:%M:%S}\n"], "'Date: 2024-05-06; Time: 12:00:00'"),
        (["# started: {0:%d.%m.%Y %H:%M:%S}\n"], f"'06.05.2024 12:00:00', {NO_DATE}"),
        (["# delay: {0:%S} s\n"], f"'delay: 00 s', {NO_DATE}"),
        (["# recording started at {0:%H:%M:%S}\n"], "'recording started at 12:00:00', which"),
        ([STARTED, "", STARTED, STARTED], "'2024-05-06T12:00:00Z', but sensor 2 names none"),
        ([""], "note: no file says when it began, so all are taken to begin at the same"),
    ],
)
def test_the_start_of_each_sensor_is_read_or_quoted(tmp_path, heads, told):
    files = [tmp_path / f"{n}.csv" for n in range(4)]
    for n, (path, head) in enumerate(zip(files, cycle(heads))):
        head = head.format(NOON + timedelta(seconds=2 * n)) + "time_s,reading"
        path.write_text(lines(TIME_S[:465], COUNTS[n, 20 * n :][:465], head=head))
    imported = import_files(tmp_path, *files, "--per-sensor", "--name", "r")
    if not told:
        np.testing.assert_array_equal(imported.the_recording().values, COUNTS[:, 60:465])
    assert told in imported.refused.partition("sensor 1 names its start, ")[2] + imported.shown


def test_many_files_are_one_table_and_each_note_is_told_once(tmp_path):
    files = [tmp_path / f"{n}.csv" for n in range(3)]
    for n, path in enumerate(files):
        path.write_text(lines(TIME_S, *np.round(VOLTS + n / 1000, 6)))
    shown = import_files(tmp_path, *files, "--unit", "V").shown
    note = "the supply voltage is unknown, so volts are judged as they are; use --vref-v"
    assert f"note: {', '.join(map(str, files))}: {note}\n" in shown and shown.count(note) == 1
    assert shown.count("time_unit") == 1 and "sensor_1  " not in shown
    rows = [line.split() for line in shown.splitlines() if line.strip().startswith(str(tmp_path))]
    assert [row[:3] for row in rows] == [[str(path), "525", "52.4"] for path in files]
    again = import_files(tmp_path / "again", *files, "--unit", "V", "--preview").shown
    assert again.count("\n  sensor_1  ") == 3
    assert all(a != b for a, b in pairwise(rows))
