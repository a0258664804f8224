"""A recording in any dialect is read as the same numbers, or refused with the deciding option."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from capsule.errors import CapsuleError
from capsule.importing.lab_yaml import checked_keys
from capsule.importing.runs import read_columns
from capsule.importing.text import read_text
from support.importing import SETTINGS

pytestmark = pytest.mark.takes(1)

SIGNS = {"comma": ",", "semicolon": ";", "tab": "\t", "space": " ", "bar": "|"}
PER_SECOND = {"s": 1, "ms": 1000, "us": 1_000_000}
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
        "quoted": st.booleans(),
        "last_end": st.booleans(),
    }
).filter(lambda each: (each["delimiter"], each["decimal"]) != ("comma", "comma"))
# The counts of each sample; two samples at most are missing, and the first one is there.
RUNS = st.lists(st.tuples(*[st.integers(0, 1023)] * 4), min_size=8, max_size=25)
LOST = st.sets(st.integers(1, 24), max_size=2)


def written(dialect, rows, lost):
    """Return a recording as bytes, its times, its readings, and the keys that describe it."""
    sign, digits, at = SIGNS[dialect["delimiter"]], dialect["digits"], dialect["time_at"]
    unit, scale = ("V", 5 / 1024) if digits else ("counts", 1)
    rounded = [[float(f"{each * scale:.{digits}f}") for each in row] for row in np.array(rows).T]
    time_s = np.arange(len(rows)) / 10
    values = np.where(np.isin(range(len(rows)), [*lost]), np.nan, rounded)

    def column(name, unit, numbers, digits):
        texts = [f"{number:.{digits}f}" for number in numbers]
        if dialect["decimal"] == "comma":
            texts = [text.replace(".", ",") for text in texts]
        heads = {"none": [], "plain": [name], "units": [f"{name}[{unit}]"], "row": [name, unit]}
        blank = "nan" if sign == " " else ""
        return [*heads[dialect["names"]], *(text.replace("nan", blank) for text in texts)]

    table = [column(f"S{n}", unit, row, digits) for n, row in enumerate(values, start=1)]
    times = time_s * PER_SECOND[dialect["time_unit"]]
    table.insert(at, column("time", dialect["time_unit"], times, int(times[1] < 1)))
    quote = '"' if dialect["quoted"] else ""
    text = [sign.join(f"{quote}{cell}{quote}" for cell in row) for row in zip(*table, strict=True)]
    content = dialect["end"].join(text) + dialect["end"] * dialect["last_end"]
    keys = {key: dialect[key] for key in ("delimiter", "decimal", "time_unit")}
    sensors = [place + 1 for place in range(5) if place != at]
    keys |= {"thousands": "none", "time": at + 1, "sensors": sensors, "unit": unit}
    return content.encode(dialect["encoding"]), time_s, values, keys


@settings(max_examples=120, deadline=None)
@given(dialect=DIALECTS, rows=RUNS, lost=LOST)
def test_a_recording_in_any_dialect_is_read_or_refused_with_what_decides(dialect, rows, lost):
    content, time_s, values, told = written(dialect, rows, lost)
    for said in ({}, told):
        try:
            keys = checked_keys(said, SETTINGS)
            read = read_columns(read_text(content, keys), keys)
        except CapsuleError as refusal:
            # A last number that lacks digits may be cut, as raw/ says too.
            if not dialect["last_end"] and "the file ends in mid-line" in str(refusal):
                return
            assert not said, f"all is said, and still: {refusal}"
            words = ("choose one", "name one with --time", "with --sensors", "use --time-unit")
            assert any(word in str(refusal) for word in words) and "--" in str(refusal)
            continue
        np.testing.assert_allclose(read.clock.time_s, time_s, atol=1e-9)
        np.testing.assert_array_equal(read.values, values)
        assert read.unit == told["unit"]
