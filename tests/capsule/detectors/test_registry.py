"""Every row of the registries names a class or function; any other name is refused."""

import pytest

from capsule.detectors.registry import DETECTORS, PAPER, detector_class, detector_row
from capsule.errors import CapsuleError


@pytest.mark.parametrize("name", DETECTORS)
def test_a_row_leads_to_a_detector_with_its_model(name):
    detector = detector_class(name)
    assert callable(detector.taught)
    assert callable(detector.restored) and callable(detector.verdict)


def test_the_papers_detector_is_the_first():
    assert next(iter(DETECTORS)) == PAPER


def test_an_unknown_name_is_refused_with_the_known_ones():
    with pytest.raises(CapsuleError, match="no detector nearest; allowed are: template, diag"):
        detector_row("nearest")
    with pytest.raises(CapsuleError, match="no detector nearest; allowed are: "):
        detector_class("nearest")
