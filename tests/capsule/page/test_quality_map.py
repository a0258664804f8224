"""The quality of each sensor is measured, and the one that stands out is named."""

import numpy as np
import pytest

from capsule.detectors.wave import wave_of
from capsule.page.quality_map import MEASURES, SHADES, quality_cells, sensor_measures
from support.sections import CONFIG
from support.synthetic import make_recording

RUN = np.linspace(-0.5, 0.5, 700)
NOISE = np.random.default_rng(1).normal(0, 40, 700)


def measured(spoil=lambda values: values, at_ends=(0.0, 0.0, 0.0, 0.0), name="0mm/r01"):
    values = spoil(make_recording(0, name).values.copy())
    return sensor_measures(wave_of(values, 10.0, CONFIG["diagonal"]), at_ends)


def on_sensor_3(disturbance):
    """Return a function that adds a disturbance to the readings of the third sensor."""

    def spoil(values):
        values[2] += disturbance
        return values

    return spoil


@pytest.mark.parametrize(
    ("key", "spoilt"),
    [
        ("drift", {"spoil": on_sensor_3(400 * RUN)}),
        ("noise", {"spoil": on_sensor_3(NOISE)}),
        ("rail", {"at_ends": (0.0, 0.0, 0.05, 0.0)}),
        ("wave", {"spoil": on_sensor_3(60 * np.sin(2 * np.pi * np.arange(700) / 12))}),
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
