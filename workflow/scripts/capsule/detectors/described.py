"""Read the scorer's weights; read and write what describes a recording to the detectors."""

from collections.abc import Iterator, Mapping
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any

import numpy as np

from capsule import files
from capsule.detectors.network import Features, Scorer
from capsule.detectors.search import Passage
from capsule.detectors.wave_traits import WaveTraits


def read_scorer(path: Path) -> Scorer:
    """Read the taught scorer's weights."""
    with np.load(path) as stored:
        return Scorer(dict(stored.items()))


def write_best_places(
    path: Path, best_places: Mapping[str, Passage], traits: Mapping[str, WaveTraits]
) -> None:
    """Write the best candidate for a nodule of some recordings, and the traits of their wave."""
    columns = ["recording", *(field.name for field in (*fields(Passage), *fields(WaveTraits)))]
    rows = (
        {"recording": name, **asdict(place), **asdict(traits[name])}
        for name, place in best_places.items()
    )
    files.write_csv(path, columns, rows)


def read_best_places(path: Path) -> dict[str, Passage]:
    """Read the candidates that `write_best_places` has written; an empty cell becomes NaN."""
    return {name: Passage(**values) for name, values in _numbers(path, Passage)}


def read_wave_traits(path: Path) -> dict[str, WaveTraits]:
    """Read the traits that `write_best_places` has written; an empty cell becomes NaN."""
    return {name: WaveTraits(**values) for name, values in _numbers(path, WaveTraits)}


def _numbers(path: Path, kind: type) -> Iterator[tuple[str, dict[str, float]]]:
    """Yield each recording of a table with the numbers of one kind."""
    names = [field.name for field in fields(kind)]
    for row in files.read_csv(path):
        yield row["recording"], {name: float(row[name] or "nan") for name in names}


def write_features(path: Path, features: Mapping[str, Features]) -> None:
    """Write the features of some recordings."""
    arrays: dict[str, Any] = {
        field.name: np.array([getattr(each, field.name) for each in features.values()])
        for field in fields(Features)
    }
    with files.write_whole(path, "wb") as stream:
        np.savez(stream, recording=np.array(list(features), dtype=np.str_), **arrays)


def read_features(path: Path) -> dict[str, Features]:
    """Read what `write_features` has written."""
    with np.load(path) as stored:
        arrays = [stored[field.name] for field in fields(Features)]
        return {
            name: Features(float(score), *rest)
            for name, score, *rest in zip(stored["recording"].tolist(), *arrays, strict=True)
        }
