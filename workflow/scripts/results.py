"""Read the tables that the stages before have written, with the paper's numbers beside ours."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
import yaml

from capsule.acceptance import accept
from capsule.paper import printed_tables
from capsule.recording import Recording, read_recording

TABLES = ("detection", "specificity", "sizing", "confusion")


@dataclass(frozen=True)
class Evaluation:
    """The tables under results/evaluation.

    Attributes
    ----------
    predictions : DataFrame
        One row a recording, detector and scheme.
    tables : dict of str to DataFrame
        ``detection``, ``specificity``, ``sizing`` and ``confusion``, of every detector.
    paper : dict of str to DataFrame
        The paper's tables in the same columns.
    """

    predictions: pd.DataFrame
    tables: Mapping[str, pd.DataFrame]
    paper: Mapping[str, pd.DataFrame]

    def detectors(self) -> list[str]:
        """Name the detectors, the paper's own first."""
        return list(dict.fromkeys(self.predictions["detector"]))

    def sizes_mm(self) -> list[float]:
        """Give the sizes that have a template, 0 included, ascending."""
        return sorted(
            float(name.removeprefix("rmse_").removesuffix("mm"))
            for name in self.predictions.columns
            if name.startswith("rmse_") and name.endswith("mm")
        )

    def of(self, name: str, detector: str, *, with_paper: bool = False) -> pd.DataFrame:
        """Give one detector's rows of a table, the paper's below them if wanted."""
        table = self.tables[name]
        rows = table[table["detector"] == detector]
        return pd.concat([rows, self.paper[name]], ignore_index=True) if with_paper else rows


def read_evaluation(folder: Path, printed: Mapping, confidence: float) -> Evaluation:
    """Read results/evaluation and put the paper's numbers beside it."""
    paper = {name: pd.DataFrame(rows) for name, rows in printed_tables(printed, confidence).items()}
    tables = {name: pd.read_csv(folder / f"{name}.csv") for name in TABLES}
    return Evaluation(pd.read_csv(folder / "predictions.csv"), tables, paper)


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
