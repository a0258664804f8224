"""Read and write what the detectors learn from, and what they have learned."""

import json
import sys
from collections.abc import Iterable, Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from capsule.arrays import FloatArray
from capsule.detectors.base import StoredRecording, TrainingArchive
from capsule.detectors.described import read_best_places, read_features
from capsule.engine.project import WEIGHTS
from capsule.errors import CapsuleError
from capsule.kinds import Settings
from capsule.method.particle import particles_of
from capsule.method.templates import TemplateSet, build_templates, by_size, template_options
from capsule.recordings.names import sizes_of
from capsule.recordings.origin import places_of
from capsule.store import files
from capsule.store.results import BEST_PLACES, FEATURES, Results


def read_training_archive(
    results: Results,
    rows: Mapping[str, Mapping[str, str]],
    fitted: Iterable[str],
    settings: Settings,
) -> TrainingArchive:
    """Read the recordings that the detectors learn from, and average their fits to the templates.

    Parameters
    ----------
    results : Results
        The files of the recordings.
    rows : mapping of str to mapping
        The rows of recordings.csv for all recordings that are judged or that teach.
    fitted : iterable of str
        The recordings of which templates are made, from
        `capsule.recordings.held_out.recordings_with_fits`.
    settings : mapping
        As in `TrainingArchive`, and the sections from which `template_options` takes its own.
    """
    features = results.described(FEATURES, rows, read_features)
    recordings = {
        name: StoredRecording(partial(results.matrix, name), *described, features[name])
        for name, described in results.described(BEST_PLACES, rows, read_best_places).items()
    }
    particles = particles_of(results.fits(fitted))
    return TrainingArchive(
        sizes_of(rows),
        recordings,
        build_templates(by_size(particles), **template_options(settings)),
        particles,
        settings,
        no_verdict={name: row["no_verdict"] for name, row in rows.items()},
        places=places_of(rows),
    )


def read_templates(path: Path) -> dict[float, FloatArray]:
    """Read templates.npz: the template of every size in mm, (S, L); size 0 is the first."""

    def read(path: Path) -> dict[float, FloatArray]:
        with path.open("rb") as stream, np.load(stream) as stored:
            return {size: stored[label] for label, size in sizes_of(stored).items()}

    return files.read_or_explain(path, read)


def read_template_set(path: Path, first_peak: int) -> TemplateSet:
    """Read templates.npz as the templates of all recordings, of which none can be left out.

    `first_peak` is u, the column of the first peak.
    """
    rendered = read_templates(path)
    return TemplateSet(tuple(rendered), (), tuple(rendered.values()), first_peak)


def write_learned(
    path: Path, models: Mapping[str, Any], settings: Settings, templates: Path
) -> None:
    """Write detectors.json: the models, what they fit to, and a checksum of all.

    The models are those of `capsule.evaluation.cross_validation.Detectors.stored`, the settings the
    sections of the configuration on which they depend, and templates.npz is named by its checksum.
    """
    content = {
        **models,
        "settings": settings,
        "scorer": files.fingerprint(WEIGHTS, sys.maxsize),
        "templates": files.fingerprint(templates, sys.maxsize),
    }
    files.write_json(path, content | {"checksum": _checksum(content)})


def read_learned(path: Path) -> dict[str, Any]:
    """Read detectors.json.

    Raises
    ------
    CapsuleError
        The file is missing, damaged or of another version; the message names it and the remedy.
    """
    content = files.read_or_explain(path, files.read_json)
    checksum = content.pop("checksum", None) if isinstance(content, dict) else None
    if checksum is None or checksum != _checksum(content):
        raise CapsuleError(
            f"{path} is damaged, or of another version; delete it, and make it again: "
            f"snakemake -c2 results/{path.name}"
        )
    return content


def is_of(learned: Settings, settings: Settings) -> bool:
    """Return whether the content of detectors.json was made with a configuration."""
    made_with = learned["settings"]
    return all(settings.get(section) == value for section, value in made_with.items())


def _checksum(content: Mapping[str, Any]) -> str:
    return files.fingerprint_of(json.dumps(content, sort_keys=True).encode())
