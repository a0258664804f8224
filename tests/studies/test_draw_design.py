"""The figures of the capsule say what its geometry is, and are those that the report shows."""

from dataclasses import replace

import pytest
from draw_design import draw_other_readings, figures, other_readings

from capsule.parts.files import read_design
from capsule.phantom.origami import pitch
from support.project import ROOT

DESIGN = read_design()


def test_the_report_shows_the_figures_of_the_design():
    folder = ROOT / "workflow" / "report" / "figures"
    assert {path.stem: path.read_bytes() for path in folder.iterdir()} == figures()


def test_each_other_reading_lies_over_the_chosen_one_with_its_pitch():
    for tip in ("bulb", "round", "curl"):
        origami = replace(DESIGN.phantom.origami, tip=tip)
        readings = other_readings(origami)
        assert next(iter(readings.values())) == origami
        assert len({str(each) for each in readings.values()}) == len(readings) == 5
    readings = other_readings(DESIGN.phantom.origami)
    figure = draw_other_readings(readings)
    titles = [axes.get_title(loc="center").split("\n") for axes in figure.axes]
    pitches = {words: pitch(each) for words, each in readings.items()}
    assert pitches.pop("chosen") == pytest.approx(6.27, abs=0.005)
    assert titles == [[words, f"pitch {each:.2f} mm"] for words, each in pitches.items()]
    assert pitches["A at the tail of BC"] == pytest.approx(5.38, abs=0.005)
    assert all(len(axes.lines) == 4 for axes in figure.axes)
