"""The report reads the stored results of each accepted recording."""

import numpy as np
import pytest

from capsule import files
from capsule.configuration import read_config_file
from capsule.page.plot_data import PlotData, write_plot_data
from capsule.page.stored import StoredRecordings
from capsule.results import FITS, PLOT_DATA, Results
from support.project import ROOT

SETTINGS = read_config_file(ROOT / "config" / "config.yaml")
PARAMETERS = {"amplitude": 4, "vertical_spread": 4, "peak_spacing": 3, "horizontal_spread": 4}
RECORDINGS = {"0mm/r01": "", "3mm/r01": "", "3mm/r02": "there is no wave", "unlabelled/p": ""}


@pytest.fixture
def stored(tmp_path):
    rows = [
        {
            "recording": name,
            "size_mm": "" if name.startswith("unlabelled") else float(name[0]),
            "status": "accepted",
            "no_verdict": no_verdict,
        }
        for name, no_verdict in RECORDINGS.items()
    ]
    columns = [*rows[0], "near_copies", "site", "session", "readings_sha256"]
    blank = dict.fromkeys(columns, "")
    files.write_csv(tmp_path / "recordings.csv", columns, [blank | row for row in rows])
    results = Results(tmp_path, RECORDINGS, 1)
    for name, no_verdict in RECORDINGS.items():
        # Also where a fit was asked for by hand.
        parameters = {key: [1.0] * length for key, length in PARAMETERS.items()}
        fit = {"recording": name, "lag": 7, "parameters": None if no_verdict else parameters}
        files.write_json(results.file(FITS, name), fit)
        drawn = {each: PlotData(f"{each}: no gap", each) for each in RECORDINGS}
        write_plot_data(results.file(PLOT_DATA, name), drawn)
    return StoredRecordings(results, SETTINGS)


def test_a_recording_of_a_nodule_has_its_fit(stored):
    numbers, particle = stored.fit("3mm/r01")
    assert numbers["lag"] == 7
    np.testing.assert_array_equal(particle.peak_spacing, np.ones(3))


@pytest.mark.parametrize("name", ["0mm/r01", "3mm/r02", "unlabelled/p"])
def test_without_a_nodule_of_known_size_or_a_wave_there_is_no_fit(stored, name):
    assert stored.fit(name) is None


def test_every_recording_has_its_signals_and_quality(stored):
    for name in RECORDINGS:
        assert (stored.drawn(name), stored.quality(name)) == (name, f"{name}: no gap")
