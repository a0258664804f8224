"""The figures of the capsule say what its geometry is, and are those that the report shows."""

from dataclasses import replace

import pytest
from draw_design import draw_capsule, draw_other_readings, figures, other_readings

from capsule.parts.files import read_design
from capsule.phantom.origami import pitch
from support.project import ROOT

DESIGN = read_design()


def test_the_report_shows_the_figures_of_the_design():
    folder = ROOT / "workflow" / "report" / "figures"
    assert {path.stem: path.read_bytes() for path in folder.iterdir()} == figures()


def texts(axes):
    return {text.get_text() for text in axes.texts}


def test_the_capsule_is_drawn_with_its_dimensions_sensors_and_bench():
    unit, row, bench = draw_capsule(DESIGN).axes
    heights = {"2", "5", "3", "w = 20", "5.52", "AA\u2032 = 4", "BB\u2032 = 4", "r = 1", "wall 0.5"}
    assert heights | {"\u03b1 = 5\u00b0", "\u03b2 = 45\u00b0", "cut", "wire", "glue"} <= texts(unit)
    assert {"1", "2", "3", "4", "head", "tail", "pitch = 6.27", "24.84"} <= texts(row)
    assert {"20", "60", "cam, radius 9", "follower 2", "sheet 3", "wall 1"} <= texts(bench)


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
