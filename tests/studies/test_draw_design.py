"""The figures of the capsule say what its geometry is, and are those that the report shows."""

from dataclasses import replace

from draw_design import figures, other_readings

from capsule.parts.files import read_design
from support.project import ROOT

DESIGN = read_design()


def test_the_report_shows_the_figures_of_the_design():
    folder = ROOT / "workflow" / "report" / "figures"
    assert {path.stem: path.read_bytes() for path in folder.iterdir()} == figures()


def test_each_other_reading_differs_from_the_chosen_one_whatever_was_chosen():
    for tip in ("bulb", "round", "curl"):
        origami = replace(DESIGN.phantom.origami, tip=tip)
        readings = other_readings(origami)
        assert next(iter(readings.values())) == origami
        assert len({str(each) for each in readings.values()}) == len(readings) == 5
