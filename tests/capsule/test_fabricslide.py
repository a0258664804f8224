"""Real recordings go the whole way by configuration alone."""

import json

import numpy as np
import pytest

from capsule.particles import Particle, peak_positions
from capsule.recording import format_recording
from support.fabricslide import FOLDER, convert
from support.project import Project

BOARD_10MM = ["Board10mm_F120_V-10mmps_0", "Board10mm_F120_V-5mmps_0", "Board10mm_F150_V-5mmps_0"]
FIRST_PEAK = 100


@pytest.fixture(scope="module")
def project(tmp_path_factory):
    """Convert the recordings, configure the workflow for them, and run it."""
    project = Project.create(tmp_path_factory.mktemp("fabricslide") / "project")
    project.configure(
        recording={"rate_hz": 36, "max_gap_s": 0.25},
        preprocessing={"window": 20, "length": 1200},
        fit={
            "first_peak": FIRST_PEAK,
            "amplitude_range": [0.001, 4.0],
            "peak_spacing_range": [8, 60],
        },
    )
    for size in (2, 10):
        (project.raw / f"{size}mm").mkdir()
        for file in FOLDER.glob(f"Board{size}mm_*.csv"):
            (project.raw / f"{size}mm" / file.name).write_bytes(format_recording(convert(file)))
    run = project.snakemake("results/templates.json")
    assert run.status == 0, run.output
    assert run.jobs["fit"] == 4
    return project


@pytest.mark.workflow
@pytest.mark.parametrize("name", BOARD_10MM)
def test_a_ridge_is_four_bumps_in_the_order_of_the_channels(project, name):
    matrix = np.load(project.results / "matrices/10mm" / f"{name}.npy")
    fit = json.loads((project.results / "fits/10mm" / f"{name}.json").read_text())
    particle = Particle(**{key: np.array(value) for key, value in fit["parameters"].items()})

    shift = fit["lag"] - 1 - matrix.shape[1]
    fitted = (peak_positions(particle.peak_spacing, FIRST_PEAK) - 1 + shift).astype(int)
    # The highest point of each row near the fitted bump: the ridge reaches one channel after
    # the other. The first bump is cut by the start of the recording.
    near = [slice(max(column - 15, 0), column + 16) for column in fitted]
    bumps = [span.start + row[span].argmax() for row, span in zip(matrix, near, strict=True)]
    heights = matrix[np.arange(4), bumps]
    assert np.all(np.diff(bumps) >= 8)
    assert np.all(heights > 0.8)
    np.testing.assert_allclose(fitted[1:], bumps[1:], atol=8)
    np.testing.assert_array_equal(bumps[1:], matrix[1:].argmax(axis=1))
    energy = np.linalg.norm(matrix) / np.sqrt(3 * matrix.size)
    assert fit["rmse"] < 0.6 * energy, "most of what is in the matrix is the ridge"


def test_the_recordings_are_as_published():
    recording = convert(FOLDER / f"{BOARD_10MM[0]}.csv")
    assert recording.values.shape == (4, 539)
    assert np.median(np.diff(recording.time_s)) == pytest.approx(0.028)
    assert (FOLDER / "LICENSE").read_text().startswith("MIT License")
