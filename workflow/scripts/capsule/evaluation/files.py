"""Read the tables of the evaluation, and the numbers that the paper prints."""

from functools import partial
from pathlib import Path
from typing import Any

import pandas as pd
import yaml

from capsule.evaluation.columns import COLUMNS
from capsule.evaluation.paper import Evaluation, printed_tables
from capsule.kinds import Settings
from capsule.store.files import read_or_explain
from capsule.store.results import OfArchive

# Columns of text that people have written: in these, 01 is not a number and NA is a name.
TEXT = {"recording", "status", "reason", "sha256", "readings_sha256", "source", "near_copies"}
TEXT |= {"path", "site", "session", "setup", "unit", "rate_hz", "detector", "scheme"}
TEXT |= {"no_verdict", "familiar", "unlike_recording", "unfamiliar_because"}
TEXT |= {"first", "second", "measure"}


def read_table(path: Path) -> pd.DataFrame:
    """Read a table that an earlier step has written; only an empty cell is an unknown value."""
    read = partial(
        pd.read_csv, dtype=dict.fromkeys(TEXT, str), keep_default_na=False, na_values=[""]
    )
    return read_or_explain(path, read)


def read_evaluation(results: Path, printed: Settings, confidence: float) -> Evaluation:
    """Read the tables of the evaluation under results/, and add the paper's numbers."""
    folder = results / OfArchive.EVALUATION
    tables = {name: read_table(folder / f"{name}.csv") for name in COLUMNS}
    paper = printed_tables(printed, confidence)
    return Evaluation(read_table(results / OfArchive.PREDICTIONS), tables, paper)


def read_printed(path: Path) -> dict[str, Any]:
    """Read paper.yaml, the numbers that the paper prints."""
    printed: dict[str, Any] = yaml.safe_load(path.read_text(encoding="utf-8"))
    return printed
