"""Fixtures for the tests of boards."""

import pytest

from support.bench.cable import SocketCable
from support.bench.emulated_rig import EmulatedRig
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


def benches(kind, folder):
    """Yield a function that makes a bench of boards; unplug the cables at the end."""
    made = []

    def make(*real, **settings):
        made.append(kind(folder, *real, **settings))
        return made[-1]

    yield make
    Surveyor.end_all()
    for each in made:
        assert not each.cables.logger.boot_loader_stuck
        each.end()


@pytest.fixture
def rig(tmp_path):
    """Return a function that makes a bench of stand-ins."""
    yield from benches(Rig, tmp_path)


@pytest.fixture
def emulated_rig(tmp_path):
    """Return a function that makes a bench with the real firmware of the boards that it names."""
    yield from benches(EmulatedRig, tmp_path)
