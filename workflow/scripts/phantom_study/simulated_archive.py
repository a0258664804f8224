"""The paper's detector on a simulated archive, templates and test from the same runs."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from capsule.detectors.matching import nearest_size, template_distances
from capsule.fitting import fit_particle
from capsule.particles import ParameterSpace
from capsule.phantom.geometry import sensor_offsets
from capsule.phantom.parameters import Phantom
from capsule.phantom.simulation import SENSORS, Run, simulate_run
from capsule.preprocessing import preprocess
from capsule.seeding import generator
from capsule.templates import TemplateSet, build_templates
from phantom_study.paper_table import SIZES_MM, motion


@dataclass(frozen=True)
class Detector:
    """The detector's settings, and how much of its labour is spared.

    Attributes
    ----------
    preprocessing
        Arguments of `capsule.preprocessing.preprocess`.
    fit
        The config's section ``fit``.
    stride
        Only every so many columns of a matrix are used; the envelope is smooth over W = 84
        columns, so a stride of 10 hardly changes a table and saves most of the time.
    """

    preprocessing: Mapping
    fit: Mapping
    stride: int = 1


def quick(detector: Detector) -> Detector:
    """Return a detector for a search: every tenth column, 300 particles, 400 iterations."""
    return Detector(
        detector.preprocessing, {**detector.fit, "particles": 300, "iterations": 400}, stride=10
    )


def simulate_archive(phantom: Phantom, seed: int, runs: int) -> dict[str, Run]:
    """Simulate so many runs of each size, 0..5 mm, by recording name such as ``3mm/r07``."""
    names = [f"{size}mm/r{run:02d}" for size in SIZES_MM for run in range(1, runs + 1)]
    return {name: simulate_run(phantom, _size(name), seed, name) for name in names}


def archive_matrices(
    archive: Mapping[str, Run],
    detector: Detector,
    spoil: Callable[[np.ndarray, str], np.ndarray] | None = None,
) -> dict[str, np.ndarray]:
    """Return the matrices V of an archive, thinned by the stride, by recording name.

    Parameters
    ----------
    archive
        From `simulate_archive`.
    spoil
        Changes the readings (S, K) of a run, given its name; a fault of a sensor.
    """
    matrices = {}
    for name, run in archive.items():
        counts = run.counts if spoil is None else spoil(run.counts, name)
        matrix = preprocess(counts.astype(np.float64), **detector.preprocessing)
        matrices[name] = np.ascontiguousarray(matrix[:, :: detector.stride])
    return matrices


def passing_samples(run: Run, phantom: Phantom) -> np.ndarray:
    """Return the samples from sensor to sensor over the nodule's place, shape (S - 1,)."""
    behind_mm = sensor_offsets(phantom.origami, SENSORS)
    return np.diff(np.searchsorted(run.head_mm, run.nodule_at_mm + behind_mm))


def archive_motion(archive: Mapping[str, Run], phantom: Phantom) -> dict[str, float]:
    """Return in how many runs over a nodule the capsule moves as the paper says, in percent."""
    arrived, passing = [], []
    for name, run in archive.items():
        if _size(name) > 0:
            arrived.append(run.time_s.size < int(phantom.advance.longest_samples))
            passing.append(passing_samples(run, phantom).mean())
    return motion(np.array(arrived), np.array(passing))


def learn(matrices: Mapping[str, np.ndarray], detector: Detector) -> TemplateSet:
    """Fit every run with a nodule and average the fits of each size into its template.

    Parameters
    ----------
    matrices
        The matrices V by recording name, such as ``3mm/r07``.
    """
    settings, stride = dict(detector.fit), detector.stride
    seed = settings.pop("seed")
    first_peak = settings.pop("first_peak") // stride
    counts = {key: settings.pop(key) for key in ("particles", "iterations")}
    for key in ("peak_spacing_range", "horizontal_spread_range"):
        settings[key] = [max(value // stride, 1) for value in settings[key]]
    space = ParameterSpace(**settings)
    particles = {float(size): [] for size in SIZES_MM if size > 0}
    for name, matrix in matrices.items():
        if _size(name) > 0:
            numbers = generator(seed, "fit", name)
            fit = fit_particle(matrix, numbers, **counts, first_peak=first_peak, space=space)
            particles[_size(name)].append(fit.particle)
    length = next(iter(matrices.values())).shape[1]
    return build_templates(particles, sensors=SENSORS, first_peak=first_peak, length=length)


def classify(matrices: Mapping[str, np.ndarray], templates: TemplateSet) -> np.ndarray:
    """Return how often runs of true size (row) are taken for size (column): (6, 6) array of int."""
    table = np.zeros((len(SIZES_MM), len(SIZES_MM)), dtype=int)
    for name, matrix in matrices.items():
        distances = template_distances(matrix, templates.matrices)
        table[int(_size(name)), int(nearest_size(distances, templates.sizes_mm))] += 1
    return table


def resubstitution(matrices: Mapping[str, np.ndarray], detector: Detector) -> np.ndarray:
    """Learn from an archive and classify that same archive, as the paper most likely did."""
    return classify(matrices, learn(matrices, detector))


def _size(name: str) -> float:
    return float(name.partition("mm/")[0])
