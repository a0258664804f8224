"""Fixtures for the tests of boards."""

import pytest

from support.bench.cable import SocketCable
from support.bench.rig import Rig
from support.bench.stand_in import StandInLogger
from support.bench.surveyor import Surveyor


@pytest.fixture
def cable():
    """Return the cable of a logger without hardware; unplug it at the end."""
    made = SocketCable(StandInLogger())
    yield made
    assert not made.boot_loader_stuck
    if made.plugged:
        made.unplug()


@pytest.fixture
def rig(tmp_path):
    """Return a function that makes a bench with the real firmware of the boards with motors."""
    made = []

    def make(**settings):
        made.append(Rig(tmp_path, **settings))
        return made[-1]

    yield make
    Surveyor.end_all()
    for each in made:
        assert not each.cables.logger.boot_loader_stuck
        each.end()
