"""The quality of each sensor is measured, what stands out is named, and faults are told."""

import numpy as np
import pytest

from capsule.detectors.wave import wave_of
from capsule.page.quality_map import MEASURES, SHADES, quality_cells, quality_words, sensor_measures
from capsule.recordings.units import shares_at_ends
from support.sections import CONFIG
from support.synthetic import make_recording

ON_SENSOR_3 = np.array([[0], [0], [1], [0]])
OTHER_WAVE = 60 * np.sin(2 * np.pi * np.arange(700) / 12)
RUN = np.linspace(-0.5, 0.5, 700)
NOISE = np.random.default_rng(1).normal(0, 40, 700)


def measured(spoil=lambda values: values, at_ends=(0.0, 0.0, 0.0, 0.0), name="0mm/r01"):
    values = spoil(make_recording(0, name).values)
    return sensor_measures(wave_of(values, 10.0, CONFIG["diagonal"]), at_ends)


@pytest.mark.parametrize(
    ("key", "spoilt"),
    [
        ("drift", {"spoil": lambda values: values + ON_SENSOR_3 * 400 * RUN}),
        ("noise", {"spoil": lambda values: values + ON_SENSOR_3 * NOISE}),
        ("rail", {"at_ends": (0.0, 0.0, 0.05, 0.0)}),
        ("wave", {"spoil": lambda values: values + ON_SENSOR_3 * OTHER_WAVE}),
    ],
)
def test_a_sensor_that_is_worse_than_those_of_the_other_recordings_is_named(key, spoilt):
    names = [f"0mm/r{number:02}" for number in range(9)]
    archive = {name: {"measures": measured(name=name)} for name in names}
    archive["0mm/r09"] = {"measures": measured(**spoilt)}
    cells, place = quality_cells(archive), list(MEASURES).index(key)
    shown = cells["0mm/r09"]["cells"][place]
    of_sensors = archive["0mm/r09"]["measures"][key]
    worst = max(of_sensors, key=lambda value: MEASURES[key].sign * value)
    assert shown == {"value": worst, "text": MEASURES[key].text(worst), "shade": SHADES}
    assert worst == of_sensors[2]
    assert f"sensor 3 {MEASURES[key].meaning}" in cells["0mm/r09"]["remarks"]
    assert not any(cells[name]["remarks"] for name in names)


def test_drift_and_noise_count_in_depths_of_the_wave():
    plain, doubled = (measured(lambda values, factor=factor: factor * values) for factor in (1, 2))
    for key in ("drift", "noise", "wave"):
        assert plain[key] == pytest.approx(doubled[key], rel=0.01, abs=0.003)
    # From the first half of the run to the second, a line that rises by 12 depths rises by 6.
    drifting = measured(lambda values: values + 12 * 6 * RUN)
    assert drifting["drift"] == pytest.approx([6.0] * 4, rel=0.15)


def test_a_recording_without_a_wave_and_an_archive_of_none_have_empty_cells():
    assert sensor_measures(None, [0.0, 0.5]) == {"rail": [0.0, 0.5]}
    cells = quality_cells({"0mm/r01": {"measures": {"rail": [0.0]}}})["0mm/r01"]["cells"]
    assert [cell["text"] for cell in cells] == ["", "", "0", ""]
    assert quality_cells({}) == {}


def test_gaps_are_told_by_their_share_and_the_longest_and_loose_sensors_by_name():
    def quality():
        return quality_words(values, shares_at_ends(values, {"adc_bits": "10"}), 10.0)

    values = 400.0 + np.arange(800).reshape(4, 200) % 37
    assert quality() == ""
    values[:, 10:14] = values[:, 50:62] = np.nan
    gaps = "gaps: 8 % of the samples, the longest 1.2 s"
    assert quality() == gaps
    values[2, 100:140] = 0.0
    values[3, :3] = values[1, 0] = 1023.0
    # Of the samples that are there: 40 and 3 of 184.
    loose = "loose: at the end of its range in"
    told = [f"sensor 3 {loose} 21.7 % of the samples", f"sensor 4 {loose} 1.6 % of the samples"]
    assert quality().split("; ") == [gaps, *told]
