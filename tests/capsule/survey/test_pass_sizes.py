"""The passes of a survey: what the workflow has learned says if they are of a known kind."""

import numpy as np
import pytest

from capsule.detectors.familiar import LEAST_PLACES
from capsule.detectors.files import read_learned
from capsule.engine.configuration import read_config_file
from capsule.engine.project import PROJECT
from capsule.survey.pass_sizes import PassSizes
from support.learned import healthy_runs, taught_by, teach_familiar, write_learned

CONFIGURATION = read_config_file(PROJECT / "config/config.yaml")
BENCH = CONFIGURATION["diagonal"]


@pytest.fixture(scope="module")
def learned(tmp_path_factory):
    """Return what the detectors have learned, with what enough simulated runs teach."""
    folder = tmp_path_factory.mktemp("results")
    write_learned(folder, CONFIGURATION, taught_by())
    teach_familiar(folder, healthy_runs(LEAST_PLACES), CONFIGURATION)
    return read_learned(folder / "detectors.json")


def test_one_strange_pass_makes_the_place_strange(learned):
    usual = list(healthy_runs(2).values())
    slow = np.repeat(usual[0], 2, axis=1)[:, :900]
    sizes = PassSizes(learned, BENCH, 10.0)
    assert sizes.familiarity(usual).familiar is True
    strange = sizes.familiarity([*usual, slow])
    assert strange.familiar is False
    assert strange == sizes.familiarity([slow])
    # A pass too short to show a wave is not known; that of a strange one is.
    short = usual[0][:, :60]
    assert sizes.familiarity([*usual, short]).familiar is None
    assert sizes.familiarity([short, slow]).familiar is False


def test_without_a_pass_or_what_was_learned_nobody_can_tell(learned):
    assert PassSizes(learned, BENCH, 10.0).familiarity([]).familiar is None
    nothing = PassSizes({}, BENCH, 10.0)
    assert nothing.familiarity(list(healthy_runs(1).values())).familiar is None
    other = PassSizes(learned, BENCH | {"pitch_mm": 7.0}, 10.0)
    assert other.familiarity(list(healthy_runs(1).values())).familiar is None
