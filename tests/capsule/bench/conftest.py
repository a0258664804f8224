"""Fixtures for the tests of boards."""

import pytest

from capsule.bench.clock import AWAKE
from support.bench.rig import Rig


@pytest.fixture
def rig(tmp_path):
    """Return a bench with the real firmware of the boards with motors."""
    with pytest.MonkeyPatch.context() as replaced:
        made = Rig(tmp_path, replaced)
        yield made
    AWAKE.__init__()
    assert not made.cables.logger.boot_loader_stuck
