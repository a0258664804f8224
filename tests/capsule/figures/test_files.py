"""A figure is written for the page, and for print at both widths, with the data that it shows."""

from importlib import import_module
from types import SimpleNamespace

import numpy as np
import pytest

from capsule.detectors.registry import DETECTORS
from capsule.figures.files import write_figure
from capsule.figures.registry import FIGURES
from capsule.figures.style import DETECTOR_LOOKS
from capsule.store.files import read_csv

INPUTS = SimpleNamespace(
    templates={0.0: np.zeros((4, 30)), 3.0: np.eye(4, 30)}, template_counts=[0, 1]
)


@pytest.mark.parametrize(
    ("kind", "names"),
    [
        ("svg", {"templates.svg", "templates.csv"}),
        ("pdf", {"templates.pdf", "templates_column.pdf", "templates.csv"}),
    ],
)
def test_a_figure_is_written_with_its_data_and_again_the_same(tmp_path, kind, names):
    line = write_figure("templates", INPUTS, kind, tmp_path)
    written = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    assert set(written) == names and len(set(written.values())) == len(names)
    assert line == f"templates: {len(read_csv(tmp_path / 'templates.csv'))} rows of data"
    write_figure("templates", INPUTS, kind, tmp_path)
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == written


@pytest.mark.parametrize("name", FIGURES)
def test_a_line_leads_to_what_makes_the_figure(name):
    assert callable(getattr(import_module(FIGURES[name]), f"{name}_drawing"))


def test_every_detector_has_a_look_of_its_own():
    assert len(DETECTORS) <= len({look["marker"] for look in DETECTOR_LOOKS})
