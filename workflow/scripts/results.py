"""Read what the stages before have written, for the figures and the report."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pandas as pd
import yaml

import files
from capsule.acceptance import accept
from capsule.judgements import TABLES, Evaluation
from capsule.judging import COLUMNS
from capsule.paper import printed_tables
from capsule.particles import Particle
from capsule.recording import Recording, read_recording


def read_evaluation(folder: Path, printed: Mapping, confidence: float) -> Evaluation:
    """Read results/evaluation and put the paper's numbers beside it."""
    paper = {name: pd.DataFrame(rows) for name, rows in printed_tables(printed, confidence).items()}
    tables = {name: pd.read_csv(folder / f"{name}.csv") for name in TABLES}
    return Evaluation(pd.read_csv(folder / "predictions.csv"), tables, paper)


def read_judgements(folder: Path) -> dict[str, pd.DataFrame]:
    """Read the tables by which the detectors are compared."""
    return {name: pd.read_csv(folder / f"{name}.csv") for name in COLUMNS}


def read_printed(path: Path) -> dict:
    """Read paper.yaml, the numbers that the paper prints."""
    return yaml.safe_load(path.read_text(encoding="utf-8"))


def read_accepted(raw: Path, name: str, settings: Mapping) -> tuple[Recording, np.ndarray]:
    """Read an accepted recording anew.

    Returns
    -------
    recording : Recording
        As it stands in the file.
    values : (S, K) array
        Its readings on an even grid in time, NaN where a sample is missing.
    """
    rules, shape = dict(settings["recording"]), settings["preprocessing"]
    sensors, max_bytes = rules.pop("sensors"), int(rules.pop("max_megabytes") * 1e6)
    with (raw / f"{name}.csv").open("rb") as stream:
        recording = read_recording(stream, sensors, max_bytes)
    return recording, accept(recording, **rules, window=shape["window"], length=shape["length"])


def read_fit(path: Path) -> tuple[dict, Particle] | None:
    """Read a recording's fit and its particle; None where it has none."""
    if not path.exists():
        return None
    fit = files.read_json(path)
    if fit["parameters"] is None:
        return None
    return fit, Particle(**{name: np.array(values) for name, values in fit["parameters"].items()})
