"""A recording in any dialect is read as the same numbers, or refused with the deciding option."""

import numpy as np
import pytest
from hypothesis import event, given, settings
from hypothesis import strategies as st

from capsule.errors import CapsuleError
from capsule.importing.lab_yaml import checked_keys
from capsule.importing.runs import read_columns
from capsule.importing.text import read_text
from support.importing import SETTINGS

pytestmark = pytest.mark.takes(1)

SIGNS = {"comma": ",", "semicolon": ";", "tab": "\t", "space": " ", "bar": "|"}
PER_SECOND = {"s": 1, "ms": 1000, "us": 1_000_000}


def read(content, **said):
    """Read a file, and return the times, the readings in their unit, and the unit."""
    keys = checked_keys(said, SETTINGS)
    reading = read_columns(read_text(content, keys), keys)
    return reading.clock.time_s, reading.values, reading.unit


DIALECTS = st.fixed_dictionaries(
    {
        "delimiter": st.sampled_from([*SIGNS]),
        "decimal": st.sampled_from(["point", "comma"]),
        "digits": st.integers(0, 4),
        "time_unit": st.sampled_from([*PER_SECOND]),
        "time_at": st.sampled_from([0, 0, 2, 4]),
        "names": st.sampled_from(["none", "plain", "units", "row"]),
        "encoding": st.sampled_from(["utf-8", "utf-8-sig", "utf-16", "cp1252"]),
        "end": st.sampled_from(["\n", "\r\n", "\r"]),
        "comments": st.integers(0, 2),
        "quoted": st.booleans(),
        "last_end": st.booleans(),
        "unused": st.booleans(),
    }
).filter(lambda each: (each["delimiter"], each["decimal"]) != ("comma", "comma"))


@st.composite
def runs(draw):
    """Draw random samples of a recording; any sample but the first can be missing."""
    samples = draw(st.lists(st.tuples(*[st.integers(0, 1023)] * 4), min_size=8, max_size=25))
    lost = draw(st.sets(st.integers(1, len(samples) - 1), max_size=2))
    return [(*sample, at not in lost) for at, sample in enumerate(samples)]


def written(dialect, rows):
    """Return a recording as bytes, its times, its readings, and the numbers of its columns."""
    scale, unit = (1, "counts") if dialect["digits"] == 0 else (5 / 1024, "V")
    sign = SIGNS[dialect["delimiter"]]
    missing = "nan" if sign == " " else ""

    def number(value, digits):
        text = f"{value:.{digits}f}"
        return text.replace(".", ",") if dialect["decimal"] == "comma" else text

    time_s = np.arange(len(rows)) / 10
    values = np.full((4, len(rows)), np.nan)
    lines = []
    for at, (*sample, there) in enumerate(rows):
        cells = [missing] * 4
        if there:
            cells = [number(each * scale, dialect["digits"]) for each in sample]
            values[:, at] = [float(cell.replace(",", ".")) for cell in cells]
        factor = PER_SECOND[dialect["time_unit"]]
        digits = 1 if factor == 1 else 0
        cells.insert(dialect["time_at"], number(time_s[at] * factor, digits))
        lines.append([*cells, "x"] if dialect["unused"] else cells)
    names, units = ["S1", "S2", "S3", "S4"], [unit] * 4
    names.insert(dialect["time_at"], "time")
    units.insert(dialect["time_at"], dialect["time_unit"])
    if dialect["unused"]:
        names.append("note")
        units.append("")
    if dialect["names"] == "units":
        names = [
            f"{name}[{each}]" if each else name for name, each in zip(names, units, strict=True)
        ]
    heads = [] if dialect["names"] == "none" else [names]
    if dialect["names"] == "row" and not (dialect["unused"] and sign == " "):
        heads.append(units)
    quote = '"' if dialect["quoted"] else ""
    text = [f"# note {n}: bench" for n in range(dialect["comments"])]
    text += [sign.join(f"{quote}{cell}{quote}" for cell in row) for row in [*heads, *lines]]
    content = dialect["end"].join(text) + (dialect["end"] if dialect["last_end"] else "")
    sensors = [column + 1 for column in range(5) if column != dialect["time_at"]]
    return content.encode(dialect["encoding"]), time_s, values, sensors, unit


@settings(max_examples=300, deadline=None)
@given(dialect=DIALECTS, rows=runs())
def test_a_recording_in_any_dialect_is_read_or_refused_with_what_decides(dialect, rows):
    content, time_s, values, sensors, unit = written(dialect, rows)
    told = {
        "delimiter": dialect["delimiter"],
        "decimal": dialect["decimal"],
        "thousands": "none",
        "time": dialect["time_at"] + 1,
        "time_unit": dialect["time_unit"],
        "sensors": sensors,
        "unit": unit,
    }
    for said in ({}, told):
        try:
            read_s, read_values, read_unit = read(content, **said)
        except CapsuleError as refusal:
            # A last number that lacks digits may be cut, as raw/ says too.
            if not dialect["last_end"] and "the file ends in mid-line" in str(refusal):
                return
            assert not said, f"all is said, and still: {refusal}"
            words = ("choose one", "name one with --time", "with --sensors", "use --time-unit")
            assert any(word in str(refusal) for word in words) and "--" in str(refusal)
            event("refused: " + str(refusal).rpartition(";")[2].strip()[:30])
            continue
        event("read at once" if not said else "read when told")
        np.testing.assert_allclose(read_s, time_s, atol=1e-9)
        np.testing.assert_array_equal(read_values, values)
        assert read_unit == unit
