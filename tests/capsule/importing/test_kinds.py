"""Each kind of text gives the right numbers, or a line with a remedy that works.

The kinds are those of public reports of faults of other programs. They are made from one recording
of the shipped archive, with a function a kind; tests/data/odd holds files of other programs, and
tests/data/kinds.txt what is told of these, and lines and names that a function puts into a table.
"""

import re
from datetime import datetime, timedelta
from itertools import cycle

import numpy as np
import pytest

from capsule.errors import CapsuleError
from capsule.importing.table import is_far, lone_runs
from capsule.recordings.recording import DECISIVE, Recording, format_recording, read_recording
from support.importing import ODD, Case, import_files, lines, write_table
from support.lab_files import COUNTS, TIME_S
from support.project import ROOT

SECTIONS = (ODD.parent / "kinds.txt").read_text(encoding="utf-8").split("\n\n== ")
TEXTS = {title.partition(":")[0]: text for title, _, text in (s.partition("\n") for s in SECTIONS)}
VOLTS = np.round(COUNTS * 5 / 1024, 5)
NOON = datetime(2024, 5, 6, 12)
COUNTED, BY_RATE, RATED = "--unit counts", "--time none --rate 10", "--rate 10"
BY_S = "--time-unit s"
V, GAP, RISING = "--unit V", "--run-gap-s 5", "--sensors 1 2 3 4 --rate 10 --unit counts"
PLAIN = lines(TIME_S, *COUNTS)
NO_TIME, NO_NAMES = lines(*COUNTS, head=""), lines(TIME_S, *COUNTS, head="")


def rows(section, case):
    """Return cases by the entries of a section of kinds.txt; before an arrow stand their words."""
    made, words = {}, ""
    for each in re.split(r"\s+\|\s+|\n", TEXTS[section]):
        before, arrow, entry = each.rpartition("=> ")
        words = before.strip() if arrow else words
        made[entry] = case(entry.replace("\\n", "\n"), words)
    return made


def table(section):
    """Return the rows of a section of kinds.txt, each with the text of its cells."""
    texts = TEXTS[section].splitlines()
    return [[cell.strip().replace("\\n", "\n") for cell in row.split("|")] for row in texts]


def odd(call):
    """Return the odd file of a call, which names it before options."""
    return ODD / f"{call.split()[0]}.txt"


def good(text, values=COUNTS, options="", words="", **more):
    """Return a case that is read."""
    return Case(text, words, options=options, values=values, **more)


def above(line, table=PLAIN):
    """Return a table with a line above it."""
    return f"{line}\n{table}"


def named(names, sign=","):
    """Return the table with other names; `{}` in one name stands for the number of the sensor."""
    if "{}" in names:
        names = sign.join(names.format(number) for number in range(1, 5))
    return lines(TIME_S, *COUNTS, head=f"time_s{sign}{names}", sign=sign)


def timed(name, times, values=COUNTS):
    """Return the table with other times, and the name of their column."""
    return lines(times, *values, head=f"{name},S1,S2,S3,S4")


def ticks(name, per_second):
    return timed(name, np.rint(TIME_S * per_second))


def wrapped(bits, per_second, low=0, scale=1):
    """Return times of a counter of some bits that begins again at the 201st sample."""
    ticks = np.rint(TIME_S * per_second).astype(int) - round(20 * per_second) + 2**bits + low
    return ((ticks - low) % 2**bits + low) / scale


EIGHT = np.loadtxt(ODD / "comma.txt", delimiter=",", skiprows=1).T[1:]
EIGHT_VOLTS = np.round(EIGHT * 5 / 1024, 4)
# What is read of a file of tests/data/odd. Some second sensors begin 0.2 s later.
VALUES = {
    "eight": EIGHT,
    "eight but the first": EIGHT[:, 1:],
    "four times eight": EIGHT * 4,
    "24 times eight": EIGHT * 24,
    "eight in volts": EIGHT_VOLTS,
    "eight in volts cut": np.where(EIGHT_VOLTS == 2.6221, 2.622, EIGHT_VOLTS),
    "eight in exact volts": np.round(EIGHT * 5 / 1024, 6),
    "eight by 5 mV": EIGHT * 5 / 1000,
    "eight in kohm": np.round(12 * EIGHT / (1024 - EIGHT), 4),
    "eight in ohm": np.round(12_000 * EIGHT / (1024 - EIGHT), 1),
    **{f"{factor} times counts": factor * COUNTS for factor in (2, 4, 20)},
    "volts": VOLTS,
    "volts later": [row[:523] if n == 1 else row[2:] for n, row in enumerate(VOLTS)],
    **{
        f"eight without {lost}": np.where(np.isin(range(8), lost), np.nan, EIGHT)
        for lost in (0, [0, 7], 2, [3, 5], 5)
    },
}
ODD_READ = {call: rest for call, *rest in table("odd files read")}
ODD_REFUSED = dict(table("odd files refused"))
NAMED = {"labchart_blocks", *(call.split()[0] for call in [*ODD_READ, *ODD_REFUSED])}
PLAIN_FILES = sorted({path.stem for path in ODD.iterdir()} - NAMED)
ODD_READ |= dict.fromkeys(PLAIN_FILES, ("", "eight", "", ""))
MILLI = COUNTS / 1000
# Counters of so many bits in a unit of time, from the lowest value on; the last one of us in s.
COUNTERS = [("us", 32, 1e6), ("us", 32, 1e6, -(2**31)), ("ms", 31, 1e3), ("ms", 16, 1e3)]
COUNTERS += [("ms", 16, 1e3, -(2**15)), ("ms", 15, 1e3), ("s", 32, 1e6, 0, 1e6)]
PAUSED = TIME_S + 300 * (TIME_S > 20)
TRUNCATED = np.where(TIME_S > 0, TIME_S + 20, 0)
STUCK = np.array([*COUNTS[:2], 7 + 0 * TIME_S, COUNTS[3]])
BY_PANDAS, FIVE = lines(TIME_S, *COUNTS, head=",0,1,2,3"), "--time 1 --sensors 2 3 4 5"
OWN = {"source": "simulated phantom", "simulator_seed": "7", "adc_bits": "10"}
CUT_TIME = lines(TIME_S + 20, *COUNTS, head="")[1:]
BACKWARDS = ("S4,S3,S2,S1", "S4, S3, S2, S1", "5,4,3,2")
READ = {
    **rows("read above", lambda line, _: good(above(line))),
    **rows("read named", lambda names, _: good(named(names))),
    "one sign of ohm": good(named("S{}_\u03a9")),
    "another sign of ohm": good(named("S{} in \u2126")),
    **rows("read rates", lambda line, _: good(above(line, lines(*COUNTS, head="S1,S2,S3,S4")))),
    **rows("read names in mV", lambda names, _: good(named(names), MILLI)),
    **rows("read above in mV", lambda line, _: good(above(line), MILLI)),
    **{
        f"{how}": good(timed(f"t ({unit})", wrapped(*how)), words="jumps by")
        for unit, *how in COUNTERS
    },
    "numbers of pandas": good(BY_PANDAS, COUNTS, FIVE, "line 1, with 0, 1, 2, 3, is passed over"),
    # What is simulated stays called simulated.
    "a recording": good(format_recording(Recording(TIME_S, COUNTS, OWN)).decode(), header=OWN),
    "first time that lacks digits": good(CUT_TIME, words="20.1 s lie between", time_s=TRUNCATED),
    "a long gap": good(timed("t", PAUSED), words="5 min follows sample 201", time_s=PAUSED),
    "a stuck sensor": good(timed("t", TIME_S, STUCK), STUCK, "", "reject it: sensor_3 reads 7 in"),
    "a rising sensor": good(NO_NAMES, np.vstack([TIME_S, COUNTS[:3]]), RISING, "sensor_1 rises"),
    **{f"sensors {each}": good(PLAIN, COUNTS[::-1], f"--sensors {each}") for each in BACKWARDS},
    "a header line twice": good(above("# session: m\n# session: m"), header={"session": "m"}),
    "first line that lacks digits": good(NO_TIME[2:], COUNTS[:, 1:], RATED, "over: 9 is far from"),
    **{
        call: good(odd(call), VALUES[values], options, note)
        for call, (options, values, _, note) in ODD_READ.items()
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
    header = imported.the_recording().header
    assert again.the_recording().header["unit"] == header["unit"]
    told = re.search("\n *passed over  +(.+)", imported.shown)
    assert header.get("import_passed_over") == (told and told[1])


JUMPED = TIME_S + 200_000 * (TIME_S == 30)
PIECES = np.s_[:300], np.s_[300:]
NAMED_AGAIN = "".join(lines(*COUNTS[:, at], head="S1,S2,S3,S4") for at in PIECES)
RESET = "".join(timed("time_s", TIME_S[at] - TIME_S[at][0], COUNTS[:, at]) for at in PIECES)


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


TWICE, ONCE = "# {0}: 1\n# bench: 2\n# bench: 3\n# {0}: 4", (*DECISIVE, "session")
ASKED = {
    **rows("units above", lambda line, unit: Case(above(line), f"names {unit} of ", COUNTED)),
    **rows("quoted above", quoted),
    **rows("units named", unit_in_names),
    **rows("quoted names", lambda n, _: Case(named(n), f"{n.format(1)!r}, and of no", COUNTED)),
    **rows("time units", unknown_unit),
    **{
        f"{hz} Hz": Case(ticks("time", hz), f"of {1 / hz:.4g} s, 10 Hz ({BY_RATE})", BY_RATE)
        for hz in (50, 100, 1024, 1e4, 32_768, 1e5, 1e7)
    },
    **rows("other rates", lambda line, told: Case(above(line), f"file states {told}; g", BY_S)),
    "time in whole seconds": Case(timed("time_s", TIME_S // 1), "does not run forward", BY_RATE),
    "a time that jumps": Case(timed("time_s", JUMPED), "sample 302: time runs backwards", BY_RATE),
    "names repeated by a reset": Case(RESET, "0 s follows 29.9 s; if another", GAP, values=None),
    "blocks of LabChart": Case(ODD / "labchart_blocks.txt", f"give {GAP}", GAP, values=None),
    "names again": Case(NAMED_AGAIN, "above line 303 the", f"{RATED} {GAP}", RATED, None),
    **{
        call: Case(odd(call), words, remedy, call.partition(" ")[2], VALUES[values])
        for call, (remedy, values, words, _) in ODD_READ.items()
        if words
    },
    **{
        call: Case(odd(call), told, "", call.partition(" ")[2])
        for call, told in ODD_REFUSED.items()
    },
    # Whatever the reader of recordings takes one value of, the import does.
    **{key: Case(above(TWICE.format(key)), f"1 and 4 name two values of {key}") for key in ONCE},
}


@pytest.mark.parametrize("kind", ASKED)
def test_a_kind_of_file_is_asked_about_and_the_remedy_works(tmp_path, kind):
    ASKED[kind].check_asked(tmp_path)


def test_readings_that_lack_digits_are_told(tmp_path):
    values = COUNTS[:, :120].copy()
    values[2, 100:102], values[0, 40], values[3, -1] = (5, 53), 4, 5
    imported = import_files(tmp_path, write_table(tmp_path / "a.csv", TIME_S[:120], *values))
    np.testing.assert_array_equal(imported.the_recording().values, values)
    sides = f"{values[0, 39]:g} before and {values[0, 41]:g} after it"
    assert f"note: line 42: 4 of sensor_1 is far from {sides}" in imported.shown
    assert "line 102 and line 103: 5 and 53 of sensor_3 is far from " in imported.shown
    assert f"line 121: 5 of sensor_4 is far from {values[3, -2]:g} before it" in imported.shown


def test_nothing_is_named_in_the_recordings_of_the_archive():
    files = sorted(ROOT.glob("raw/*mm/*.csv"))[::4]
    assert len(files) > 50
    for path in files:
        with path.open("rb") as stream:
            values = read_recording(stream, 4).values
        assert not lone_runs(values) and not is_far(values).all(), path


@pytest.mark.parametrize(("heads", "told"), table("starts"))
def test_the_start_of_each_sensor_is_read_or_quoted(tmp_path, heads, told):
    files = [tmp_path / f"{n}.csv" for n in range(4)]
    for n, (path, head) in enumerate(zip(files, cycle(heads.split(" & ")))):
        head = head.format(NOON + timedelta(seconds=2 * n)) + "\ntime_s,reading"
        path.write_text(lines(TIME_S[:465], COUNTS[n, 20 * n :][:465], head=head))
    imported = import_files(tmp_path, *files, "--per-sensor", "--name", "r")
    if not told:
        np.testing.assert_array_equal(imported.the_recording().values, COUNTS[:, 60:465])
    assert told in imported.refused.partition("sensor 1 names its start, ")[2] + imported.shown


@pytest.mark.parametrize(("content", "words"), table("maps refused"))
def test_a_map_that_is_wrong_is_told_with_key_value_and_what_is_allowed(tmp_path, content, words):
    path = tmp_path / "lab.yaml"
    path.write_text(content)
    with pytest.raises(CapsuleError) as fault:
        import_files(tmp_path, ODD / "comma.txt", "--map", path)
    assert words in str(fault.value) and str(path) in str(fault.value)


def test_many_files_are_one_table_and_each_note_is_told_once(tmp_path):
    files = [write_table(tmp_path / f"{n}.csv", TIME_S, *VOLTS + n / 100) for n in range(3)]
    shown = import_files(tmp_path, *files, "--unit", "V").shown
    note = "the supply voltage is unknown, so volts are judged as they are; use --vref-v"
    assert f"note: {', '.join(map(str, files))}: {note}\n" in shown and shown.count(note) == 1
    assert shown.count("time_unit") == 1 and "sensor_1  " not in shown
    assert all(re.search(rf"\n *{path} +525 +52\.4 ", shown) for path in files)
    again = import_files(tmp_path / "again", *files, "--unit", "V", "--preview").shown
    assert again.count("\n  sensor_1  ") == 3
