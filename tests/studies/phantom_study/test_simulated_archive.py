"""The paper's detector works on simulated archives, and the motion of their capsule is right."""

from dataclasses import replace

import numpy as np
import pytest
from phantom_study import simulated_archive
from phantom_study.paper_table import read_paper_table
from phantom_study.simulated_archive import read_detector

from capsule.phantom.files import DEFAULT_TABLE, read_phantom
from capsule.phantom.parameters import with_values

pytestmark = pytest.mark.takes(0.2)

PHANTOM = read_phantom(DEFAULT_TABLE, [])
DETECTOR = simulated_archive.quick(read_detector())
PAPER = read_paper_table()


@pytest.fixture(scope="module")
def archive():
    return simulated_archive.simulate_archive(PHANTOM, 3, 4)


@pytest.fixture(scope="module")
def matrices(archive):
    return simulated_archive.archive_matrices(archive, DETECTOR)


def test_an_archive_has_every_size_thinned_by_the_stride(matrices):
    assert len(matrices) == 6 * 4
    assert {matrix.shape for matrix in matrices.values()} == {(4, 100)}


def test_a_run_that_is_stopped_by_hand_has_not_arrived(archive):
    sizes = [run.time_s.size for name, run in archive.items() if not name.startswith("0mm")]
    stopped = with_values(PHANTOM, {"advance.longest_samples": max(sizes)})
    share = simulated_archive.archive_motion(archive, stopped, PAPER)["reaches the far side"]
    assert share == pytest.approx(100 * np.mean(np.array(sizes) < max(sizes)))
    assert share < 100


def test_passing_times_are_those_of_the_sensors(archive):
    """At a steady speed, the sensors meet the nodule one after the other, a pitch apart."""
    run = archive["3mm/r01"]
    for speed, usual in ((0.4, 100), (1.0, 0), (0.2, 0)):
        steady = replace(run, time_s=np.arange(2000) / 10, head_mm=speed * np.arange(2000) / 10)
        motion = simulated_archive.archive_motion({"3mm/r01": steady}, PHANTOM, PAPER)
        assert motion["Delta mu 100 to 250"] == usual


def test_an_archive_is_judged_with_templates_from_its_own_runs(archive, matrices):
    confusion, motion = simulated_archive.simulate_and_judge(PHANTOM, DETECTOR, PAPER, 4, 3)
    np.testing.assert_array_equal(confusion.sum(axis=1), 4)
    assert confusion[5, 2:].sum() > confusion[0, 2:].sum()
    templates = simulated_archive.learn(matrices, DETECTOR)
    np.testing.assert_array_equal(confusion, simulated_archive.classify(matrices, templates))
    assert motion == simulated_archive.archive_motion(archive, PHANTOM, PAPER)
