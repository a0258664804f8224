"""Read the taught scorer's weights; read and write the features that it computes."""

from collections.abc import Iterable, Mapping
from dataclasses import astuple, fields
from pathlib import Path
from typing import Any

import numpy as np

from capsule.detectors.scorer import Features, Scorer
from capsule.detectors.stretches import Stretches
from edges import files

# The weights that ship with the project.
WEIGHTS = Path(__file__).resolve().parents[2] / "weights" / "scorer.npz"


def read_scorer(path: Path) -> Scorer:
    """Read the taught scorer's weights."""
    with np.load(path) as stored:
        return Scorer(dict(stored.items()))


def write_features(path: Path, features: Mapping[str, Features]) -> None:
    """Write the features of some recordings."""
    arrays: dict[str, Any] = {
        field.name: np.array([getattr(each, field.name) for each in features.values()])
        for field in fields(Features)
    }
    with files.write_whole(path, "wb") as stream:
        np.savez(stream, recording=np.array(list(features), dtype=np.str_), **arrays)


def read_features(paths: Iterable[Path], recordings: Iterable[str]) -> dict[str, Features]:
    """Read the features of some recordings from the files that hold them."""
    wanted, features = set(recordings), {}
    for path in paths:
        with np.load(path) as stored:
            arrays = [stored[field.name] for field in fields(Features)]
            for name, score, *rest in zip(stored["recording"].tolist(), *arrays, strict=True):
                if name in wanted:
                    features[name] = Features(float(score), *rest)
    return features


def write_stretches(path: Path, stretches: Mapping[str, Stretches | None]) -> None:
    """Write the losses of each recording's score without each stretch, if they are known.

    The file holds one array for each recording: score, first, step, and then the losses.
    """
    arrays: dict[str, Any] = {
        name: np.hstack(astuple(each)) for name, each in stretches.items() if each is not None
    }
    with files.write_whole(path, "wb") as stream:
        np.savez(stream, **arrays)


def read_stretches(paths: Iterable[Path], recordings: Iterable[str]) -> dict[str, Stretches]:
    """Read the stretches of some recordings from the files that hold them."""
    wanted, stretches = set(recordings), {}
    for path in paths:
        with np.load(path) as stored:
            for name in wanted.intersection(stored):
                score, first, step, *loss = stored[name].tolist()
                stretches[name] = Stretches(score, first, step, np.array(loss))
    return stretches
