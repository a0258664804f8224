"""Read what the detectors judge recordings by: matrices, passages and templates."""

from collections.abc import Iterable, Mapping
from dataclasses import fields
from pathlib import Path

import numpy as np

from capsule.detectors.passage import Passage
from capsule.naming import folder_of, folder_size_mm
from capsule.particles import Particle
from capsule.templates import TemplateSet, total
from edges import files
from edges.fits import by_size


def read_matrix(folder: Path, recording: str) -> np.ndarray:
    """Read a recording's matrix V, (S, L)."""
    return np.load(folder / f"{recording}.npy")


def read_templates(path: Path) -> dict[float, np.ndarray]:
    """Read templates.npz: the template of every size in mm, (S, L), that of 0 first."""
    with np.load(path) as stored:
        return {folder_size_mm(label): matrix for label, matrix in stored.items()}


def read_template_set(
    path: Path, first_peak: int, particles: Mapping[str, Particle] | None = None
) -> TemplateSet:
    """Read the templates of all recordings.

    Parameters
    ----------
    path : Path
        templates.npz.
    first_peak : int
        u, the column of the first peak.
    particles : mapping of str to Particle, optional
        The fits behind them, where recordings are to be left out.
    """
    rendered = read_templates(path)
    totals = ()
    if particles:
        groups = by_size(particles)
        sensors = next(iter(rendered.values())).shape[0]
        totals = tuple(total(groups.get(size, ()), sensors) for size in rendered)
    return TemplateSet(tuple(rendered), totals, tuple(rendered.values()), first_peak)


def read_passages(folder: Path, recordings: Iterable[str]) -> dict[str, Passage]:
    """Read the passages of some recordings, a table a folder; an empty cell is unknown."""
    wanted = set(recordings)
    names = [field.name for field in fields(Passage)]
    return {
        row["recording"]: Passage(**{name: float(row[name] or "nan") for name in names})
        for label in sorted({folder_of(name) for name in wanted})
        for row in files.read_csv(folder / f"{label}.csv")
        if row["recording"] in wanted
    }
