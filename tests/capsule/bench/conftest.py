"""Fixtures for the tests of boards."""

import pytest

from support.bench.rig import Rig
from support.bench.surveyor import Surveyor


@pytest.fixture
def rig(tmp_path):
    """Return a function that makes a bench with the real firmware of the boards with motors."""
    made = []

    def make():
        made.append(Rig(tmp_path))
        return made[-1]

    yield make
    Surveyor.end_all()
    for each in made:
        assert not each.cables.logger.boot_loader_stuck
        each.end()
