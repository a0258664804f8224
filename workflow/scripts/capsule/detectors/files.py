"""Read what the detectors learn from: templates, matrices and descriptions of recordings."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from capsule.arrays import FloatArray
from capsule.detectors.described import read_best_places, read_features, read_wave_traits
from capsule.detectors.training import TrainingArchive
from capsule.fits import by_size
from capsule.kinds import Settings
from capsule.naming import sizes_of
from capsule.particles import Particle
from capsule.places import places_of
from capsule.results import BEST_PLACES, FEATURES, Results
from capsule.templates import ParticleTotal, TemplateSet, total


def read_templates(path: Path) -> dict[float, FloatArray]:
    """Read templates.npz: the template of every size in mm, (S, L); size 0 is the first."""
    with np.load(path) as stored:
        return {size: stored[label] for label, size in sizes_of(stored).items()}


def read_template_set(
    path: Path, first_peak: int, particles: Mapping[str, Particle] | None = None
) -> TemplateSet:
    """Read templates.npz as the templates that are made from all recordings.

    `first_peak` is u, the column of the first peak. `particles` are the fits behind the templates,
    which are needed only to leave recordings out later.
    """
    rendered = read_templates(path)
    totals: tuple[ParticleTotal, ...] = ()
    if particles:
        groups = by_size(particles)
        sensors = next(iter(rendered.values())).shape[0]
        totals = tuple(total(groups.get(size, ()), sensors) for size in rendered)
    return TemplateSet(tuple(rendered), totals, tuple(rendered.values()), first_peak)


def read_training_archive(
    results: Results,
    rows: Mapping[str, Mapping[str, str]],
    templates: TemplateSet,
    particles: Mapping[str, Particle],
    settings: Settings,
) -> TrainingArchive:
    """Read the recordings that the detectors learn from; other parameters as in `TrainingArchive`.

    `results` are the files of the recordings, and `rows` the rows of recordings.csv for all
    recordings that are judged or that teach.
    """
    return TrainingArchive(
        sizes_of(rows),
        templates,
        particles,
        results.described(BEST_PLACES, rows, read_best_places),
        results.matrix,
        settings,
        results.described(FEATURES, rows, read_features),
        {name: row["no_verdict"] for name, row in rows.items()},
        places_of(rows),
        results.described(BEST_PLACES, rows, read_wave_traits),
    )
