"""Read the scorer's weights; read and write what describes a recording to the detectors."""

from collections.abc import Mapping
from dataclasses import asdict, fields
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from capsule.detectors.network import Features, Scorer
from capsule.detectors.search import Passage
from capsule.detectors.wave_traits import WaveTraits
from capsule.store import files

# What a row of best_places holds.
_KINDS = (Passage, WaveTraits)
_FEATURES = [field.name for field in fields(Features)]


@lru_cache(maxsize=1)
def read_scorer(path: Path) -> Scorer:
    """Read the taught scorer's weights."""
    with np.load(path) as stored:
        return Scorer(dict(stored.items()))


def write_best_places(path: Path, described: Mapping[str, tuple[Passage, WaveTraits]]) -> None:
    """Write the best candidate for a nodule of some recordings, and the traits of their wave."""
    columns = ["recording", *(field.name for kind in _KINDS for field in fields(kind))]
    rows = (
        {"recording": name, **asdict(place), **asdict(traits)}
        for name, (place, traits) in described.items()
    )
    files.write_csv(path, columns, rows)


def read_best_places(path: Path) -> dict[str, tuple[Passage, WaveTraits]]:
    """Read what `write_best_places` has written; an empty cell becomes NaN."""

    def numbers(row: Mapping[str, str], kind: type) -> dict[str, float]:
        return {field.name: float(row[field.name] or "nan") for field in fields(kind)}

    return {
        row["recording"]: (Passage(**numbers(row, Passage)), WaveTraits(**numbers(row, WaveTraits)))
        for row in files.read_csv(path)
    }


def write_features(path: Path, features: Mapping[str, Features]) -> None:
    """Write the features of some recordings."""
    arrays: dict[str, Any] = {
        key: np.array([getattr(each, key) for each in features.values()]) for key in _FEATURES
    }
    with files.write_whole(path, "wb") as stream:
        np.savez(stream, recording=np.array(list(features), dtype=np.str_), **arrays)


def read_features(path: Path) -> dict[str, Features]:
    """Read what `write_features` has written."""
    with np.load(path) as stored:
        columns = [stored[key] for key in ("recording", *_FEATURES)]
    return {
        str(name): Features(float(score), *rest)
        for name, score, *rest in zip(*columns, strict=True)
    }
