"""Cases of faulty files under raw/, each with the reason that the workflow gives."""

import io
import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from capsule.recordings.names import displayed
from capsule.recordings.recording import Recording, format_recording, read_recording
from support.synthetic import make_recording

SAMPLES = 300
HOSTILE = "<script>alert(1)</script>"


@dataclass(frozen=True)
class Case:
    """A faulty file.

    Attributes
    ----------
    what : str
        Description of the fault.
    name : str or bytes
        The path under raw/.
    make : callable
        Function that makes the file at a path.
    reason : str
        The complete reason in recordings.csv or passed_over.csv.
    """

    what: str
    name: str | bytes
    make: Callable[[Path], object]
    reason: str

    @property
    def listed_as(self) -> str:
        """Return the name of the file in the tables."""
        text = displayed(os.fsdecode(self.name))
        return text if self.refused_by_name else text.removesuffix(".csv")

    @property
    def refused_by_name(self) -> bool:
        """Return whether the file is rejected without being opened."""
        return self.reason.startswith(("rename the file", "a folder", "a link", "a pipe"))


def recording(name: str) -> Recording:
    """Return a good recording, a different one for every name."""
    return make_recording(3.0, f"bad/{name}", samples=SAMPLES)


def content(name: str) -> bytes:
    """Return the bytes of a good recording, different ones for every name."""
    return format_recording(recording(name))


def bare(name: str) -> bytes:
    """Return a good recording without header lines."""
    return content(name)[content(name).index(b"time_s") :]


def write(data: bytes) -> Callable[[Path], object]:
    """Return a function that writes bytes to a path."""
    return lambda path: path.write_bytes(data)


def changed(name: str, **changes: object) -> Callable[[Path], object]:
    """Return a function that writes a changed recording to a path."""
    made = vars(recording(name)) | changes
    return write(format_recording(Recording(**made)))


def cell(name: str, line: int, text: str) -> bytes:
    """Return a recording in which the second cell of a line is replaced."""
    lines = content(name).decode().splitlines()
    cells = lines[line - 1].split(",")
    lines[line - 1] = ",".join([cells[0], text, *cells[2:]])
    return ("\n".join(lines) + "\n").encode()


def sensor(name: str, number: int, readings: object) -> np.ndarray:
    """Return the readings with one sensor replaced."""
    values = recording(name).values.copy()
    values[number - 1] = readings
    return values


def huge(path: Path) -> None:
    """Make a file of 1 GB that uses no space on the disk."""
    with path.open("wb") as stream:
        stream.truncate(1_000_000_000)


TIMES = np.arange(SAMPLES) * 0.1
INDEX = np.arange(SAMPLES)
COLUMNS = b"time_s,sensor_1,sensor_2,sensor_3,sensor_4"
RENAME = (
    "rename the file: only letters A-Z, digits and _ . + - are allowed in its name, "
    "at most 100 of them, and the first is a letter or digit"
)


def swapped(values: np.ndarray, index: int, value: float) -> np.ndarray:
    """Return times with one of them replaced."""
    result = values.copy()
    result[index] = value
    return np.round(result, 3)


def jittered(data: bytes) -> bytes:
    """Return a recording with jitter in all its times except the first and the last."""
    read = read_recording(io.BytesIO(data), 4)
    moved = np.random.default_rng(1).uniform(-0.025, 0.025, read.time_s.size)
    moved[[0, -1]] = 0.0
    return format_recording(Recording(np.round(read.time_s + moved, 3), read.values, read.header))


UNREADABLE = [
    Case("empty file", "3mm/empty.csv", write(b""), "the file is empty"),
    Case(
        "only header lines",
        "3mm/header-only.csv",
        write(b"# source: bench 2\n# rate_hz: 10\n"),
        "the file ends after its header; column names and samples are missing",
    ),
    Case(
        "column names, but no sample",
        "3mm/no-sample.csv",
        write(COLUMNS + b"\n"),
        "the file ends after its column names; the samples are missing",
    ),
    Case(
        "a column is missing",
        "3mm/column-missing.csv",
        write(b"time_s,sensor_1,sensor_2,sensor_3\n0,1,2,3\n"),
        "line 1: the column 'sensor_4' is missing; found: 'time_s,sensor_1,sensor_2,sensor_3', "
        f"required: {COLUMNS.decode()}",
    ),
    Case(
        "a column that appears twice",
        "3mm/column-doubled.csv",
        write(COLUMNS + b",sensor_2\n0,1,2,3,4,5\n"),
        "line 1: the column 'sensor_2' appears more than once",
    ),
    Case(
        "a column has another name",
        "3mm/column-renamed.csv",
        write(bare("renamed").replace(b"sensor_3", b"Sensor3")),
        "line 1: the column 'sensor_3' is missing; found: "
        f"'time_s,sensor_1,sensor_2,Sensor3,sensor_4', required: {COLUMNS.decode()}",
    ),
    Case(
        "a fifth sensor",
        "3mm/fifth-sensor.csv",
        write(COLUMNS + b",sensor_5\n0,1,2,3,4,5\n"),
        "line 1: there is a column 'sensor_5', but recording.sensors is 4",
    ),
    Case(
        "text in a cell",
        "3mm/text.csv",
        write(cell("text", 40, "n/a")),
        "line 40: 'n/a' is not a number",
    ),
    Case(
        "NaN in a cell",
        "3mm/nan.csv",
        write(cell("nan", 41, "NaN")),
        "line 41: 'NaN' is not a number",
    ),
    Case(
        "infinity in a cell",
        "3mm/inf.csv",
        write(cell("inf", 42, "-inf")),
        "line 42: '-inf' is not a number",
    ),
    Case(
        "a number that is too large",
        "3mm/overflow.csv",
        write(cell("overflow", 43, "1e999")),
        "line 43: '1e999' is too large",
    ),
    Case(
        "HTML in a cell",
        "3mm/html-cell.csv",
        write(cell("html", 44, HOSTILE)),
        f"line 44: '{HOSTILE}' is not a number",
    ),
    Case(
        "one cell of a sample is empty",
        "3mm/empty-cell.csv",
        write(cell("empty cell", 45, "")),
        "line 45: a cell is empty; for a missing sample, leave all sensor cells empty",
    ),
    Case(
        "semicolons between the columns",
        "3mm/semicolons.csv",
        write(bare("semicolons").replace(b",", b";")),
        "line 1 separates columns by semicolons or tabs; "
        "use commas between columns and points in numbers; if another program wrote it: "
        "capsule import raw/3mm/semicolons.csv --size 3 --name semicolons-imported --dry-run",
    ),
    Case(
        "decimal commas",
        "3mm/decimal-commas.csv",
        write(bare("commas").replace(b".", b",")),
        "line 3 has 6 cells, but there are 5 columns (a cut-off line, or decimal commas?)",
    ),
    Case(
        "UTF-16",
        "3mm/utf-16.csv",
        write(content("utf-16").decode().encode("utf-16")),
        "the file is not UTF-8 text (UTF-16, or binary?); save it as UTF-8",
    ),
    Case(
        "Latin-1",
        "3mm/latin-1.csv",
        write("# source: Messplatz für Kapseln\n".encode("latin-1") + bare("latin-1")),
        "byte 22 is not UTF-8 text (another encoding?); save it as UTF-8",
    ),
    Case(
        "a picture",
        "3mm/picture.csv",
        write(b"\x89PNG\r\n\x1a\n" + bytes(range(256)) * 40),
        "the file is not UTF-8 text (UTF-16, or binary?); save it as UTF-8",
    ),
    Case(
        "one endless line",
        "3mm/one-line.csv",
        write(b"a,b," * 500_000),
        "line 1 has 2000000 characters; a line of a recording has at most 10000",
    ),
    Case(
        "too many lines",
        "3mm/many-lines.csv",
        write(COLUMNS + b"\n" * 250_000),
        "the file has 250000 lines; a recording has at most 200000",
    ),
    Case(
        "a file that ends within a line",
        "3mm/cut-off.csv",
        write(content("cut off")[:-7]),
        "line 305 is cut off: the file ends in mid-line; copy it again",
    ),
    Case(
        "a later format",
        "3mm/format-2.csv",
        write(content("format").replace(b"format_version: 1", b"format_version: 2")),
        "the header says format_version '2'; this program reads version 1 only",
    ),
    Case(
        "a header of 5 MB",
        "3mm/header-long.csv",
        write(b"# note: " + b"\n# note: ".join([b"x" * 9000] * 550) + b"\n" + bare("header")),
        "line 2: the header lines hold more than 10000 characters; keep long notes in a separate "
        "file",
    ),
    Case(
        "two sessions in one header",
        "3mm/two-sessions.csv",
        write(b"# session: Monday\n# session: Tuesday\n" + bare("sessions")),
        "line 2: the header says session 'Monday' above, and 'Tuesday' here; keep the line that is "
        "true",
    ),
    Case(
        "a header value that is not a number",
        "3mm/adc-bits.csv",
        write(content("bits").replace(b"adc_bits: 10", b"adc_bits: ten")),
        "the header says adc_bits: 'ten', which is not a number",
    ),
    Case(
        "1 GB",
        "3mm/huge.csv",
        huge,
        "the file is larger than 16 MB and cannot be one run (limit: recording.max_megabytes)",
    ),
]

UNUSABLE = [
    Case(
        "a sensor with the same reading in all samples",
        "3mm/constant.csv",
        changed("constant", values=sensor("constant", 2, 512)),
        "sensor_2 reads 512 in all samples; check its connection, and check it for a short circuit",
    ),
    Case(
        "a sensor at the end of the ADC's range for most of the run",
        "3mm/rail.csv",
        changed("rail", values=sensor("rail", 3, np.where(INDEX < 200, 1023, 500 + INDEX % 7))),
        "sensor_3 is at 1023, the end of the ADC's range, in 67 % of the samples; "
        "at most 20 % are allowed (recording.max_rail_fraction)",
    ),
    Case(
        "the same, without a header that gives the range",
        "3mm/rail-bare.csv",
        changed(
            "rail",
            values=sensor("bare", 1, np.where(INDEX < 240, 1023, 512 + INDEX % 5)),
            header={},
        ),
        "sensor_1 is at 1023, the end of the ADC's range, in 80 % of the samples; "
        "at most 20 % are allowed (recording.max_rail_fraction)",
    ),
    Case(
        "the same, in volts",
        "3mm/rail-volts.csv",
        changed(
            "volts",
            values=sensor("volts", 4, np.where(INDEX < 180, 1023, 512 + INDEX % 5)) * 5.0 / 1023,
            header={"vref_v": "5.0"},
        ),
        "sensor_4 is at 4.99268 V, the end of the ADC's range, in 60 % of the samples; "
        "at most 20 % are allowed (recording.max_rail_fraction)",
    ),
    Case(
        "a sensor at the end of the ADC's range for a third of the run",
        "3mm/rail-third.csv",
        changed("third", values=sensor("third", 2, np.where(INDEX < 99, 1023, 500 + INDEX % 7))),
        "sensor_2 is at 1023, the end of the ADC's range, in 33 % of the samples; "
        "at most 20 % are allowed (recording.max_rail_fraction)",
    ),
    Case(
        "a sensor that is stuck in most samples",
        "3mm/stuck.csv",
        changed("stuck", values=sensor("stuck", 4, np.where(INDEX % 10 == 0, 488, 487))),
        "sensor_4 reads 487 in 90 % of the samples, so it is stuck or loose; "
        "at most 80 % are allowed (recording.max_constant_fraction)",
    ),
    Case(
        "two channels with the readings of one sensor",
        "3mm/shorted.csv",
        changed("shorted", values=recording("shorted").values[[0, 1, 1, 3]]),
        "sensor_2 and sensor_3 give nearly the same readings (correlation 1.000); "
        "check the channels for a short circuit (recording.max_sensor_correlation)",
    ),
    Case(
        "resistances that are not positive",
        "3mm/ohm.csv",
        changed("ohm", header={"unit": "ohm"}, values=sensor("ohm", 1, INDEX % 7)),
        "the header says unit: ohm, but a reading is 0; every resistance must be above 0",
    ),
    Case(
        "an unknown unit",
        "3mm/unit.csv",
        changed("unit", header={"unit": "psi"}),
        "the header says unit: 'psi'; allowed are counts, V, ohm and kohm",
    ),
    Case(
        "readings outside the ADC's range",
        "3mm/outside.csv",
        changed("outside", values=sensor("outside", 1, 900 + INDEX)),
        "sensor_1 reads 1199, outside the ADC's range 0..1023 (adc_bits in the header)",
    ),
    Case(
        "time that runs backwards",
        "3mm/backwards.csv",
        changed("backwards", time_s=swapped(TIMES, 50, 1.0)),
        "time runs backwards: 1 s follows 4.9 s; correct time_s",
    ),
    Case(
        "time that repeats",
        "3mm/repeats.csv",
        changed("repeats", time_s=swapped(TIMES, 50, 4.9)),
        "time repeats: 4.9 s follows 4.9 s; correct time_s",
    ),
    Case(
        "a gap longer than allowed",
        "3mm/gap.csv",
        changed("gap", time_s=np.round(TIMES + 3.0 * (INDEX > 100), 3)),
        "samples are missing for 3 s, from 10.1 s on; at most 2 s are allowed "
        "(recording.max_gap_s)",
    ),
    Case(
        "19 of 20 samples missing",
        "3mm/missing.csv",
        changed("missing", values=np.where(INDEX % 20 == 0, recording("missing").values, np.nan)),
        "285 of 300 samples (95 %) are missing; at most 20 % are allowed "
        "(recording.max_missing_fraction)",
    ),
    Case(
        "a sampling rate that changes during the run",
        "3mm/two-rates.csv",
        changed("two rates", time_s=np.round(TIMES - 0.05 * np.maximum(INDEX - 180, 0), 3)),
        "the sampling rate changes: 20 Hz in the 84 samples from 19.75 s on, 10 Hz in most others "
        "(recording.rate_tolerance); record it again at one rate, or cut the file there",
    ),
    Case(
        "more samples than fit into the time",
        "3mm/too-many.csv",
        changed("too many", time_s=np.round(TIMES - 0.05 * np.clip(INDEX - 180, 0, 20), 3)),
        "too many samples for their time: 184 samples up to 18.15 s, but 10 Hz give 183; "
        "record it again, or correct time_s",
    ),
    Case(
        "another sampling rate",
        "3mm/rate.csv",
        changed("rate", time_s=np.round(INDEX * 0.05, 3)),
        "the sampling rate is 20 Hz, but recording.rate_hz is 10",
    ),
    Case(
        "time in milliseconds",
        "3mm/milliseconds.csv",
        changed("milliseconds", time_s=INDEX * 100.0),
        "the sampling rate is 0.01 Hz, but recording.rate_hz is 10; "
        "is time_s in 1/1000 of a second?",
    ),
    Case(
        "shorter than the window",
        "3mm/short.csv",
        changed("short", time_s=TIMES[:83], values=recording("short").values[:, :83]),
        "83 samples are fewer than the window of 84 (preprocessing.window)",
    ),
    Case(
        "a single sample",
        "3mm/single.csv",
        changed("single", time_s=TIMES[:1], values=recording("single").values[:, :1]),
        "a recording needs at least 2 samples; this one has 1",
    ),
    Case(
        "longer than the matrix",
        "3mm/long.csv",
        lambda path: path.write_bytes(format_recording(make_recording(3.0, "long", samples=1001))),
        "1001 samples are more than the 1000 columns of the matrix; raise preprocessing.length",
    ),
    Case(
        "a time stamp that is far too large",
        "3mm/wild-time.csv",
        changed("wild", time_s=np.append(TIMES[:-1], 1e15)),
        "1e+16 samples are more than the 1000 columns of the matrix; raise preprocessing.length",
    ),
    Case(
        "the same content under two names",
        "1mm/zz-copy.csv",
        lambda path: path.write_bytes((path.parent / "r01.csv").read_bytes()),
        "the same content as 1mm/r01",
    ),
    Case(
        "the same readings, other line ends and another header",
        "1mm/zz-edited.csv",
        lambda path: path.write_bytes(
            b"# source: copied\r\n" + (path.parent / "r02.csv").read_bytes()
        ),
        "the same content as 1mm/r02",
    ),
    Case(
        "the same, under a name that comes first in the order",
        "1mm/a-copy-of-r01.csv",
        lambda path: path.write_bytes((path.parent / "r01.csv").read_bytes()),
        "the same content as 1mm/r01",
    ),
    Case(
        "the same content under two sizes, first file",
        "3mm/twice.csv",
        write(content("twice")),
        "the same content as 4mm/twice, under another size: one of the two is mislabelled",
    ),
    Case(
        "the same content under two sizes, second file",
        "4mm/twice.csv",
        write(content("twice")),
        "the same content as 3mm/twice, under another size: one of the two is mislabelled",
    ),
]

NO_FILES = [
    Case("a folder named like a recording", "3mm/folder.csv", Path.mkdir, "a folder, not a file"),
    Case(
        "a broken link",
        "3mm/broken-link.csv",
        lambda path: path.symlink_to("nowhere.csv"),
        "a link to a file that does not exist",
    ),
    Case(
        "a link to itself",
        "3mm/loop.csv",
        lambda path: path.symlink_to("loop.csv"),
        "a link to a file that does not exist",
    ),
    Case(
        "a pipe",
        "3mm/pipe.csv",
        lambda path: os.mkfifo(path),
        "a pipe or a device, not a file",
    ),
    Case(
        "an endless device",
        "3mm/zero.csv",
        lambda path: path.symlink_to("/dev/zero"),
        "a pipe or a device, not a file",
    ),
    Case(
        "a link to a file elsewhere",
        "3mm/link-out.csv",
        lambda path: path.symlink_to("/etc/passwd"),
        "a link to a place outside raw/; replace it with a copy of the file",
    ),
    Case(
        "a link to a virtual file of the system",
        "3mm/link-proc.csv",
        lambda path: path.symlink_to("/proc/self/status"),
        "a link to a place outside raw/; replace it with a copy of the file",
    ),
]

STRANGE_NAMES = [
    Case(what, b"3mm/" + name + b".csv", write(content(repr(name))), RENAME)
    for what, name in [
        ("a space", b"two words"),
        ("a quote", b"o'clock"),
        ("a double quote", b'say "r01"'),
        ("a command for the shell", b"$(touch pwned)"),
        ("another command for the shell", b"`touch pwned`"),
        ("a third command for the shell", b"r01;touch pwned;"),
        ("a variable", b"$HOME"),
        ("a wildcard of the shell", b"r*"),
        ("a wildcard of Snakemake", b"{recording}"),
        ("a line feed", b"line\nbreak"),
        ("an escape sequence", b"\x1b[31mred"),
        ("HTML", b'"><img src=x onerror=alert(1)>'),
        ("a leading dash", b"-rf"),
        ("letters beyond ASCII", "Prüfling-é".encode()),
        ("bytes that are not UTF-8", b"\xff\xfe"),
        ("text that runs backwards", "r01\u202egpj".encode()),
        ("a backslash", b"3mm\\r01"),
        ("240 letters", b"r" * 240),
    ]
]

PASSED_OVER = [
    Case("a leading dot", "3mm/.r07.csv", write(content("dot")), "hidden file"),
    Case("a note", "3mm/notes.txt", write(b"moved the sensor"), "not a .csv file"),
    Case(
        "a suffix in capitals",
        "3mm/R07.CSV",
        write(content("capitals")),
        "not a .csv file: write the ending in lower case",
    ),
    Case(
        "an unfinished recording",
        "3mm/r07.csv.part",
        write(content("part")),
        "an unfinished recording; if no recorder is running, complete it with "
        "capsule record --recover",
    ),
    Case(
        "a folder inside a folder",
        "3mm/monday",
        Path.mkdir,
        "a folder; put recordings directly into the folder of their size",
    ),
    Case(
        "a recording beside the folders",
        "r07.csv",
        write(content("beside")),
        "directly in raw/; move it into a folder such as 3mm/",
    ),
    Case(
        "a recording in a hidden folder",
        ".5mm/x.csv",
        write(content("hidden folder")),
        "in a hidden folder; move it into a folder such as 3mm/",
    ),
    Case(
        "a hidden recording beside the folders",
        ".r08.csv",
        write(content("hidden beside")),
        "hidden file",
    ),
    Case(
        "a name that is a formula",
        "=1+1.csv",
        write(content("formula")),
        "directly in raw/; move it into a folder such as 3mm/",
    ),
    Case(
        "a formula with a full-width equals sign",
        "\uff1d1+1.csv",
        write(content("full-width formula")),
        "directly in raw/; move it into a folder such as 3mm/",
    ),
    Case(
        "a link to a folder elsewhere",
        "7mm",
        lambda path: path.symlink_to("/etc"),
        "a link to a place outside raw/; replace it with a copy of the linked folder",
    ),
    *(
        Case(
            what,
            name,
            Path.mkdir,
            "a folder whose name is not a size; rename it, for example to 0mm, 2.5mm or unlabelled",
        )
        for what, name in [
            ("a folder of another unit", "3cm"),
            ("a folder with a space", "3 mm"),
            ("a folder with a decimal comma", "2,5mm"),
            ("a folder in capitals", "3MM"),
            ("a folder that is a command", "$(touch pwned)mm"),
            ("a folder that is HTML", "<b>3mm"),
            ("a folder whose name is not UTF-8", b"\xffmm"),
        ]
    ),
]

REJECTED = [*UNREADABLE, *UNUSABLE, *NO_FILES, *STRANGE_NAMES]

HARMLESS = [
    ("a byte order mark", lambda data: b"\xef\xbb\xbf" + data),
    ("CRLF line ends", lambda data: data.replace(b"\n", b"\r\n")),
    ("the line ends of old Macs", lambda data: data.replace(b"\n", b"\r")),
    (
        "HTML and formulas in the header",
        lambda data: data.replace(b"# source: ", f"# {HOSTILE}: x\n# source: ={HOSTILE} ".encode()),
    ),
    ("no header", lambda data: data[data.index(b"time_s") :]),
    (
        "columns in another order, and more of them",
        lambda data: b"".join(
            line if line.startswith(b"#") else b"x," + line for line in data.splitlines(True)
        ),
    ),
    (
        "a last line without a line feed, and no header",
        lambda data: data[data.index(b"time_s") : -1],
    ),
    ("a clock that jitters by a quarter of the interval", lambda data: jittered(data)),
]
