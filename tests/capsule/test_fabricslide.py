"""Real recordings give matrices, fits and templates with changes of the configuration only.

They are of a tactile finger on a board of ridges (wngfra/FabricSlide, MIT), have 16 channels and a
time stamp in ms, and lie in tests/data/fabricslide/ with their licence.
"""

import numpy as np
import pytest

import capsule
from capsule.method.particle import peak_positions
from support.importing import import_files
from support.project import ROOT, Project

FOLDER = ROOT / "tests/data/fabricslide"
MAP = ROOT / "docs/examples/fabricslide.yaml"
BOARD_10MM = ["Board10mm_F120_V-10mmps_0", "Board10mm_F120_V-5mmps_0", "Board10mm_F150_V-5mmps_0"]
FIRST_PEAK = 100


@pytest.mark.takes(2)
def test_readings_stay_as_published_and_a_ridge_is_four_bumps_in_the_channels_order(tmp_path):
    project = Project.create(tmp_path / "project")
    ranges = {"amplitude_range": [0.001, 4.0], "peak_spacing_range": [8, 60]}
    project.configure(
        recording={"rate_hz": 36, "max_gap_s": 0.25},
        preprocessing={"window": 20, "length": 1200},
        fit={"first_peak": FIRST_PEAK, **ranges},
    )
    options = "--map", MAP, "--config", project.folder / "config/config.yaml"
    # The boards have ridges of 2 or 10 mm.
    for size in ("2", "10"):
        files = FOLDER.glob(f"Board{size}mm_*.csv")
        imported = import_files(project.folder, *sorted(files), *options, size=size)
        assert imported.status == 0, imported.refused
    recordings = imported.recordings()
    archive = capsule.load(project.raw)
    assert (len(archive.labelled), len(archive.templates.matrices)) == (4, 3)
    for name in BOARD_10MM:
        recording = recordings[f"10mm/{name}"]
        table = np.loadtxt(FOLDER / f"{name}.csv", delimiter=",", skiprows=1)
        # After the time stamp and two readings of proximity.
        np.testing.assert_array_equal(recording.values, table[:, 9:13].T)
        np.testing.assert_allclose(recording.time_s, (table[:, 0] - table[0, 0]) / 1000)
        matrix, fit = archive.matrices[f"10mm/{name}"], archive.fit(f"10mm/{name}")
        spacing, shift = fit.particle.peak_spacing, fit.lag - 1 - matrix.shape[1]
        fitted = (peak_positions(spacing, FIRST_PEAK) - 1 + shift).astype(int)
        # One channel after the other meets the ridge. The start of the run cuts the first bump.
        bumps = [matrix[0, : fitted[0] + 16].argmax(), *matrix[1:].argmax(axis=1)]
        np.testing.assert_allclose(fitted[1:], bumps[1:], atol=8)
        assert np.diff(bumps).min() >= 8 and matrix[np.arange(4), bumps].min() > 0.8
