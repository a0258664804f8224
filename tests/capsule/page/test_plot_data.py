"""The plot data of recordings are read as they were written, and hold what the report draws."""

from capsule.configuration import read_config_file
from capsule.page.packing import deflated, to_json
from capsule.page.plot_data import PlotData, plot_data, read_plot_data, write_plot_data
from capsule.page.recording_evidence import RecordingResults, recording_evidence
from support.project import ROOT
from support.synthetic import make_recording

SETTINGS = read_config_file(ROOT / "config" / "config.yaml")


def test_plot_data_come_back_as_they_were(tmp_path):
    drawn = {"3mm/r1": PlotData("no gap", "ab+/="), "3mm/r2": PlotData("gaps: 5 %", "cd")}
    write_plot_data(tmp_path / "batch.json", drawn)
    assert read_plot_data(tmp_path / "batch.json") == drawn


def test_a_batch_without_a_usable_recording_has_no_plot_data(tmp_path):
    write_plot_data(tmp_path / "batch.json", {})
    assert read_plot_data(tmp_path / "batch.json") == {}


def test_they_are_the_quality_in_words_and_the_evidence_of_the_recording_alone():
    values = make_recording(3.0, "3mm/r01", samples=300).values
    check = {"header": {}, "sha256": "0" * 64, "at_ends": [0.0] * 4}
    made = plot_data("3mm/r01", values, check, None, 10.0, SETTINGS)
    assert made.quality.startswith("no gap")
    alone = recording_evidence("3mm/r01", RecordingResults(values, check, None), 10.0, SETTINGS)
    assert made.drawn == deflated(to_json(alone))
