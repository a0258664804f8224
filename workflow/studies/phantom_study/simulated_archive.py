"""Apply the paper's detector to a simulated archive, with templates from the same runs."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from capsule.engine.configuration import read_config_file
from capsule.engine.project import CONFIG
from capsule.method.particle import Particle, fit_options, fit_particle
from capsule.method.preprocessing import preprocess
from capsule.method.templates import (
    TemplateSet,
    build_templates,
    by_size,
    nearest_size,
    template_distances,
)
from capsule.phantom.advance import first_arrival
from capsule.phantom.origami import sensor_offsets
from capsule.phantom.parameters import Phantom
from capsule.phantom.simulation import SENSORS, Run, simulate_run
from capsule.recordings.names import size_mm
from capsule.seeding import generator
from phantom_study.paper_table import PaperTable

DEFAULT_CONFIG = CONFIG / "config.yaml"
# The envelope is smooth over W = 84 columns, so this stride hardly changes a table of `quick`, and
# saves most of the time.
_STRIDE = 10
SIZES_MM = (0, 1, 2, 3, 4, 5)


@dataclass(frozen=True)
class DetectorSettings:
    """The settings of the paper's detector."""

    preprocessing: Mapping  # arguments of `capsule.method.preprocessing.preprocess`
    fit: Mapping  # of the configuration; its times count in the columns that are used
    stride: int = 1  # distance of the columns of a matrix that are used


def read_detector(config: Path = DEFAULT_CONFIG) -> DetectorSettings:
    """Read the settings of the paper's detector from the project's configuration."""
    settings = read_config_file(config)
    return DetectorSettings(settings["preprocessing"], settings["fit"])


def quick(detector: DetectorSettings) -> DetectorSettings:
    """Return the settings for a search: every tenth column, 300 particles, 400 iterations."""
    fit = {**detector.fit, "particles": 300, "iterations": 400}
    fit["first_peak"] //= _STRIDE
    for key in ("peak_spacing_range", "horizontal_spread_range"):
        fit[key] = [max(value // _STRIDE, 1) for value in fit[key]]
    return DetectorSettings(detector.preprocessing, fit, _STRIDE)


def simulate_archive(phantom: Phantom, seed: int, runs: int) -> dict[str, Run]:
    """Return simulated runs of each size, 0..5 mm, by recording names such as ``3mm/r07``."""
    names = [f"{size}mm/r{run:02d}" for size in SIZES_MM for run in range(1, runs + 1)]
    return {name: simulate_run(phantom, size_mm(name), seed, name) for name in names}


def archive_matrices(
    archive: Mapping[str, Run], detector: DetectorSettings
) -> dict[str, np.ndarray]:
    """Return the matrices V of an archive, reduced by the stride, by recording name."""
    matrices = {}
    for name, run in archive.items():
        matrix = preprocess(run.counts.astype(np.float64), **detector.preprocessing)
        matrices[name] = np.ascontiguousarray(matrix[:, :: detector.stride])
    return matrices


def passing_samples(run: Run, phantom: Phantom) -> np.ndarray:
    """Return the times from sensor to sensor over the nodule in samples, shape (S - 1,)."""
    behind_mm = sensor_offsets(phantom.origami, SENSORS)
    return np.diff(first_arrival(run.head_mm, run.nodule_at_mm + behind_mm))


def archive_motion(
    archive: Mapping[str, Run], phantom: Phantom, paper: PaperTable
) -> dict[str, float]:
    """Return the shares by the names of `PaperTable.motion`, in percent of runs over a nodule."""
    over_nodules = [run for run in archive.values() if run.nodule_mm > 0]
    longest = int(phantom.advance.longest_samples)
    arrived = np.array([run.time_s.size < longest for run in over_nodules])
    passing = np.array([passing_samples(run, phantom).mean() for run in over_nodules])
    low, high = paper.passing_samples
    usual = (passing >= low) & (passing <= high)
    shares = 100 * float(arrived.mean()), 100 * float(usual.mean())
    return dict(zip(paper.motion, shares, strict=True))


def fit_archive(
    matrices: Mapping[str, np.ndarray], detector: DetectorSettings
) -> dict[str, Particle]:
    """Return a fitted particle for every matrix V of a run with a nodule, by recording name.

    The name seeds the random numbers of the fit, as it seeds the simulated run. So no two runs are
    copies, and a trial in the log can be repeated.
    """
    seed, options = detector.fit["seed"], fit_options(detector.fit)
    return {
        name: fit_particle(matrix, generator(seed, "fit", name), **options).particle
        for name, matrix in matrices.items()
        if size_mm(name) > 0
    }


def average_fits(
    particles: Mapping[str, Particle], detector: DetectorSettings, length: int
) -> TemplateSet:
    """Return the templates: the average of the particles of each size.

    Parameters
    ----------
    particles
        Particles from `fit_archive`.
    detector
        Settings of the fits.
    length
        Number of columns of the fitted matrices.
    """
    first_peak = detector.fit["first_peak"]
    groups = by_size(particles)
    return build_templates(groups, sensors=SENSORS, first_peak=first_peak, length=length)


def learn(matrices: Mapping[str, np.ndarray], detector: DetectorSettings) -> TemplateSet:
    """Fit every run with a nodule, and return the average of the fits of each size."""
    length = next(iter(matrices.values())).shape[1]
    return average_fits(fit_archive(matrices, detector), detector, length)


def classify(matrices: Mapping[str, np.ndarray], templates: TemplateSet) -> np.ndarray:
    """Return the confusion table: true size (row), classified size (column), (6, 6) int array."""
    table = np.zeros((len(SIZES_MM), len(SIZES_MM)), dtype=int)
    for name, matrix in matrices.items():
        distances = template_distances(matrix, templates.matrices)
        table[int(size_mm(name)), int(nearest_size(distances, templates.sizes_mm))] += 1
    return table


def simulate_and_judge(
    phantom: Phantom, detector: DetectorSettings, paper: PaperTable, runs: int, seed: int
) -> tuple[np.ndarray, dict[str, float]]:
    """Simulate one archive with some runs of each size, and judge it as in the paper.

    The templates come from the same runs, as probably in the paper.

    Returns
    -------
    confusion : (6, 6) array of int
        Table from `classify`.
    motion : dict of str to float
        Shares from `archive_motion`.
    """
    archive = simulate_archive(phantom, seed, runs)
    matrices = archive_matrices(archive, detector)
    confusion = classify(matrices, learn(matrices, detector))
    return confusion, archive_motion(archive, phantom, paper)
