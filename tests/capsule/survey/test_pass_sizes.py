"""The passes of a survey: what the workflow has learned says if they are of a known kind."""

import numpy as np

from capsule.detectors.familiar import LEAST_PLACES
from capsule.detectors.files import read_learned
from capsule.engine.configuration import read_config_file
from capsule.engine.project import PROJECT
from capsule.survey.pass_sizes import PassSizes
from support.learned import healthy_runs, taught_by, teach_familiar, write_learned

CONFIGURATION = read_config_file(PROJECT / "config/config.yaml")
BENCH = CONFIGURATION["diagonal"]


def test_one_strange_pass_makes_the_place_strange(tmp_path):
    write_learned(tmp_path, CONFIGURATION, taught_by())
    teach_familiar(tmp_path, healthy_runs(LEAST_PLACES), CONFIGURATION)
    learned = read_learned(tmp_path / "detectors.json")
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
    # Without a pass, or what was learned on this bench, nobody can tell.
    assert sizes.familiarity([]).familiar is None
    for nothing in (PassSizes({}, BENCH, 10.0), PassSizes(learned, BENCH | {"pitch_mm": 7}, 10.0)):
        assert nothing.familiarity(usual).familiar is None
