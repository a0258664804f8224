"""A matrix is read as numpy has written it."""

import numpy as np
import pytest

from capsule.detectors.files import read_matrix


@pytest.mark.parametrize("shape", [(4, 1000), (3, 50), (1, 7)])
def test_a_matrix_is_read_as_numpy_reads_it(tmp_path, shape):
    for run in (1, 2):
        path = tmp_path / "3mm" / f"r{run}.npy"
        path.parent.mkdir(exist_ok=True)
        np.save(path, np.random.default_rng(run).normal(size=shape))
        np.testing.assert_array_equal(read_matrix(tmp_path, f"3mm/r{run}"), np.load(path))
