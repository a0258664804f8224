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
    time = Channel(name, values, rates_hz={} if rate_hz is None else {"fs": rate_hz})
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


# Other refusals, and dates, stand in test_kinds.py.
@pytest.mark.parametrize(
    ("values", "words"),
    [([0, np.nan, 2], "sample 2: the time is missing in column 1; com"), ([0.0], "fewer than two")],
)
def test_a_time_that_is_missing_or_alone_is_refused(values, words):
    with pytest.raises(CapsuleError, match=words):
        clock(np.array(values))
