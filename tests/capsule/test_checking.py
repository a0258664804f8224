"""The check of a recording, from its bytes to the content of results/checks/."""

import numpy as np
import pytest

from capsule.checking import check_recording
from capsule.configuration_files import read_config_file
from capsule.page.quality import quality_words
from capsule.recording import Recording, format_recording
from support.project import ROOT
from support.synthetic import make_recording

SETTINGS = read_config_file(ROOT / "config" / "config.yaml")
LARGEST = 1_000_000
# The highest count of the ADC in the unit of each recording.
UNITS = {
    "10 bit": ({"adc_bits": "10"}, 1),
    "12 bit": ({"adc_bits": "12"}, 4),
    "volts": ({"vref_v": "5", "adc_bits": "10"}, 5 / 1024),
    "volts of 12 bit": ({"unit": "V", "vref_v": "3.3", "adc_bits": "12"}, 3.3 / 1024),
}


def check(values, header):
    recording = Recording(make_recording(0, "0mm/r01").time_s, values, header)
    return check_recording("0mm/r01", format_recording(recording), LARGEST, SETTINGS)


@pytest.mark.parametrize(("header", "step"), UNITS.values(), ids=UNITS)
@pytest.mark.parametrize("high", [False, True], ids=["lowest", "highest"])
def test_a_loose_sensor_is_told_in_every_unit(header, step, high):
    counts = make_recording(0, "0mm/r01").values
    values = counts * step
    bits = int(header["adc_bits"])
    top = 2**bits - 1 if "vref_v" not in header else float(header["vref_v"]) * (1 - 2**-bits)
    values[2, :70] = top if high else 0
    made, readings, _ = check(values, header)
    assert made["status"] == "accepted", made["reason"]
    assert made["at_ends"] == [0, 0, pytest.approx(0.1), 0]
    assert quality_words(readings, made["at_ends"], 10.0) == (
        "sensor 3 loose: at the end of its range in 10 % of the samples"
    )


def test_a_rejected_recording_has_no_share_at_the_ends():
    values = make_recording(0, "0mm/r01").values
    values[1] = 0
    made, readings, _ = check(values, {"adc_bits": "10"})
    assert made["status"] == "rejected" and made["at_ends"] == []
    assert np.isnan(readings).all()
