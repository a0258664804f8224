"""Every row of the figures' registry leads to a function."""

from importlib import import_module

import pytest

from capsule.detectors.registry import DETECTORS
from capsule.figures import style
from capsule.figures.registry import FIGURES


@pytest.mark.parametrize("name", FIGURES)
def test_a_row_leads_to_what_makes_the_figure(name):
    row = FIGURES[name]
    assert callable(getattr(import_module(row.module), row.made_by))


def test_every_detector_has_a_look_of_its_own():
    assert len(DETECTORS) <= len(style.DETECTOR_LOOKS)
    assert len({look["marker"] for look in style.DETECTOR_LOOKS}) == len(style.DETECTOR_LOOKS)
