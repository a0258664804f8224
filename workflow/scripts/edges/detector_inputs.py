"""Read the inputs of the detectors: matrices, passages, features and templates."""

import argparse
from collections.abc import Iterable, Mapping
from dataclasses import fields
from functools import lru_cache, partial
from io import BytesIO
from pathlib import Path

import numpy as np

from capsule.arrays import FloatArray
from capsule.detectors.passage import Passage
from capsule.detectors.training import TrainingArchive
from capsule.naming import sizes_of
from capsule.particles import Particle
from capsule.templates import ParticleTotal, TemplateSet, total
from edges import files
from edges.fits import by_size
from edges.reading import read_whole
from edges.scorer_files import read_features


def read_matrix(folder: Path, recording: str) -> FloatArray:
    """Read a recording's matrix V, (S, L).

    All matrices have the same header, so it is understood once. np.load would take four times as
    long, and thousands of matrices are read in a row.
    """
    content = read_whole(folder / f"{recording}.npy")
    begin = content.index(b"\n") + 1
    shape, kind = _header(content[:begin])
    matrix: FloatArray = np.frombuffer(content, kind, offset=begin).reshape(shape)
    return matrix


@lru_cache(maxsize=8)
def _header(header: bytes) -> tuple[tuple[int, ...], np.dtype[np.float64]]:
    """Return shape and type of the array behind a header of numpy's format 1.0."""
    stream = BytesIO(header)
    np.lib.format.read_magic(stream)
    shape, _, kind = np.lib.format.read_array_header_1_0(stream)
    return shape, kind


def read_templates(path: Path) -> dict[float, FloatArray]:
    """Read templates.npz: the template of every size in mm, (S, L); size 0 is the first."""
    with np.load(path) as stored:
        return {size: stored[label] for label, size in sizes_of(stored).items()}


def read_template_set(
    path: Path, first_peak: int, particles: Mapping[str, Particle] | None = None
) -> TemplateSet:
    """Read the templates that are made from all recordings.

    Parameters
    ----------
    path : Path
        templates.npz.
    first_peak : int
        u, the column of the first peak.
    particles : mapping of str to Particle, optional
        The fits behind the templates; needed only to leave recordings out later.
    """
    rendered = read_templates(path)
    totals: tuple[ParticleTotal, ...] = ()
    if particles:
        groups = by_size(particles)
        sensors = next(iter(rendered.values())).shape[0]
        totals = tuple(total(groups.get(size, ()), sensors) for size in rendered)
    return TemplateSet(tuple(rendered), totals, tuple(rendered.values()), first_peak)


def read_passages(paths: Iterable[Path], recordings: Iterable[str]) -> dict[str, Passage]:
    """Read the passages of some recordings from the tables that hold them.

    An empty cell becomes NaN, which means unknown.
    """
    wanted = set(recordings)
    names = [field.name for field in fields(Passage)]
    return {
        row["recording"]: Passage(**{name: float(row[name] or "nan") for name in names})
        for path in paths
        for row in files.read_csv(path)
        if row["recording"] in wanted
    }


def read_training_archive(
    arguments: argparse.Namespace,
    rows: Mapping[str, Mapping[str, str]],
    sizes_mm: Mapping[str, float],
    templates: TemplateSet,
    particles: Mapping[str, Particle],
) -> TrainingArchive:
    """Read the recordings and templates that the detectors learn from.

    Parameters
    ----------
    arguments : argparse.Namespace
        Arguments of a script: the folder ``matrices``, the files ``passages`` and ``features``,
        and the sections of the configuration, ``settings``. ``features`` is empty if no detector
        needs it.
    rows : mapping of str to mapping
        The rows of recordings.csv, for all recordings that are judged or that teach.
    sizes_mm, templates, particles
        The arguments of `TrainingArchive` with these names.
    """
    passages = read_passages(arguments.passages, rows)
    features = read_features(arguments.features, rows)
    load = partial(read_matrix, arguments.matrices)
    no_verdict = {name: row["no_verdict"] for name, row in rows.items()}
    return TrainingArchive(
        sizes_mm, templates, particles, passages, load, arguments.settings, features, no_verdict
    )
