"""Read what the detectors judge recordings by: matrices, passages and templates."""

from collections.abc import Iterable
from dataclasses import fields
from pathlib import Path

import numpy as np

from capsule.detectors.passage import Passage
from capsule.naming import folder_of, folder_size_mm
from capsule.templates import TemplateSet
from edges import files


def read_matrix(folder: Path, recording: str) -> np.ndarray:
    """Read a recording's matrix V, (S, L)."""
    return np.load(folder / f"{recording}.npy")


def read_templates(path: Path) -> dict[float, np.ndarray]:
    """Read templates.npz: the template of every size in mm, (S, L), that of 0 first."""
    with np.load(path) as stored:
        return {folder_size_mm(label): matrix for label, matrix in stored.items()}


def read_template_set(path: Path, first_peak: int) -> TemplateSet:
    """Read the templates of all recordings; without the sums that leaving one out takes."""
    rendered = read_templates(path)
    return TemplateSet(tuple(rendered), (), tuple(rendered.values()), first_peak)


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
