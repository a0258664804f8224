"""Times of any unit become seconds, or the refusal names those that fit."""

from dataclasses import replace

import numpy as np
import pytest

from capsule.errors import CapsuleError
from capsule.importing.lab_yaml import checked_keys
from capsule.importing.table import Channel, Table
from capsule.importing.times import read_time
from support.importing import SETTINGS

TIME_S = np.arange(50) / 10
PER_SECOND = {"s": 1, "ms": 1e3, "us": 1e6, "ns": 1e9, "day": 1 / 86_400, "min": 1 / 60}


def clock(values, name="", rate_hz=None, configured_hz=10.0, **said):
    keys = replace(checked_keys(said, SETTINGS), rate_hz=configured_hz)
    rates_hz = {} if rate_hz is None else {"fs": rate_hz}
    if isinstance(values[0], str):
        time = Channel(name, np.full(len(values), np.nan), words=values)
    else:
        time = Channel(name, np.asarray(values, dtype=float), rates_hz=rates_hz)
    return read_time(Table([time]), None if name == "none" else time, time, keys)


@pytest.mark.parametrize("unit", ["s", "ms", "us", "ns", "day"])
def test_the_unit_is_the_one_that_gives_a_rate_that_can_be(unit):
    # Whole numbers at a rate farther from the configured one are asked about: test_kinds.py.
    for hertz in (5, 10, 20) if unit in ("ms", "us", "ns") else (5, 10, 20, 36, 120, 500):
        time_s = np.arange(50) / hertz
        read = clock((45_000.25 if unit == "day" else 0) + time_s * PER_SECOND[unit])
        assert (read.unit, read.started) == (unit, "")
        np.testing.assert_allclose(read.time_s, time_s, atol=2e-5)
    if unit in ("s", "ms", "us"):
        read = clock((1_772_625_600 + TIME_S) * PER_SECOND[unit])
        assert (read.unit, read.started) == (unit, "2026-03-04T12:00:00Z")


def test_a_unit_in_the_name_or_a_known_rate_decides():
    names = {"time (s)": "s", "millis": "ms", "micros": "us", "t_us": "us", "Zeit [ms]": "ms"}
    for name, unit in {**names, "time/min": "min"}.items():
        assert clock(TIME_S * PER_SECOND[unit], name).unit == unit
    assert clock(np.arange(50) * 0.4, rate=2.5).unit == "s"
    assert clock(np.arange(50) * 0.4, rate_hz=2500).unit == "ms"
    assert clock(np.arange(50) * 0.4, configured_hz=2.5).unit == "s"
    assert clock(np.arange(50) * 1.0, configured_hz=1000).unit == "ms"


@pytest.mark.parametrize("rate_hz", [5.6e-308, -10.0, 1e39, float("nan"), float("inf")])
def test_a_rate_that_cannot_be_is_refused_where_it_gives_the_time(rate_hz):
    for said in ({"name": "none"}, {"name": "sample", "time_unit": "sample"}):
        with pytest.raises(CapsuleError, match=r"file is not between 0\.2 and 100000 Hz; give the"):
            clock(np.arange(50.0), rate_hz=rate_hz, **said)


# Other refusals, and the orders of day and month, stand in test_kinds.py.
@pytest.mark.parametrize(
    ("values", "said", "words"),
    [
        ([0, np.nan, 2], {}, "sample 2: the time is missing in column 1; complete it, or use"),
        ([0.0], {}, "there are fewer than two samples"),
        (TIME_S, {"time_unit": "date"}, "sample 1, column 1: '0' is not a date such as 2026"),
        (["30/04/2026 12:00:00", "04/30/2026 12:00:01"], {}, "sample 2, column 1: '04/30/2026"),
    ],
)
def test_what_cannot_be_the_time_is_refused_with_what_decides(values, said, words):
    with pytest.raises(CapsuleError) as refusal:
        clock(values, **said)
    assert words in str(refusal.value)


def test_day_and_month_that_are_the_same_a_leap_second_and_two_zones_are_read():
    for first, last in (
        ("03/03/2026 23:59:59", "03/03/2026 23:59:59.1"),
        ("04/30/2026 23:59:60", "05/01/2026 00:00:00.1"),
        ("2026-03-04T12:00:00+02:00", "2026-03-04T10:00:00.1Z"),
    ):
        np.testing.assert_allclose(clock([first, last]).time_s, [0, 0.1])
