"""Templates are read with the sizes that their names tell."""

import numpy as np
import pytest

from capsule.detectors.files import read_template_set, read_templates
from capsule.particle import Particle

SHAPES = {"0mm": np.zeros((4, 9)), "2.5mm": np.ones((4, 9)), "10mm": np.eye(4, 9)}


@pytest.fixture
def path(tmp_path):
    np.savez(tmp_path / "templates.npz", **SHAPES)
    return tmp_path / "templates.npz"


def test_templates_are_read_by_size_in_their_order(path):
    read = read_templates(path)
    assert list(read) == [0.0, 2.5, 10.0]
    np.testing.assert_equal(list(read.values()), list(SHAPES.values()))


def test_a_set_of_templates_holds_the_fits_behind_each_if_they_are_given(path):
    particle = Particle(np.ones(4), np.full(4, 0.3), np.full(3, 2.0), np.full(4, 9.0))
    alone = read_template_set(path, 3)
    assert (alone.sizes_mm, alone.first_peak, alone.totals) == ((0.0, 2.5, 10.0), 3, ())
    whole = read_template_set(path, 3, {"2.5mm/r01": particle, "2.5mm/r02": particle})
    assert [total.count for total in whole.totals] == [0, 2, 0]
