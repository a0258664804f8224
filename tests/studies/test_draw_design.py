"""The figures of the capsule say what its geometry is, and are those that the report shows."""

from draw_design import figures

from support.project import ROOT


def test_the_report_shows_the_figures_of_the_design():
    folder = ROOT / "workflow" / "report" / "figures"
    assert {path.stem: path.read_bytes() for path in folder.iterdir()} == figures()
