"""Read the tables of the evaluation, and the numbers that the paper prints."""

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any

import pandas as pd
import yaml

from capsule.evaluation.columns import COLUMNS
from capsule.evaluation.cross_validation import Rows, choosing_scheme
from capsule.evaluation.paper import Evaluation, printed_tables
from capsule.evaluation.sites import site_table
from capsule.files import read_or_explain
from capsule.kinds import Cells, Settings
from capsule.results import OfArchive

# Columns of text that people have written: in these, 01 is not a number and NA is a name.
TEXT = {"recording", "status", "reason", "sha256", "readings_sha256", "source", "near_copies"}
TEXT |= {"path", "site", "session", "setup", "unit", "rate_hz", "detector", "scheme"}
TEXT |= {"familiar", "unfamiliar_because", "no_verdict", "first", "second", "measure"}


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


def judged_sites(
    predictions: Path, detections: Sequence[Cells], index: Rows, rules: Settings
) -> list[dict[str, Any]]:
    """Return the rows of results/sites.csv.

    Parameters
    ----------
    predictions : Path
        results/evaluation/predictions.csv; its places teach the thresholds of several passes.
    detections : sequence of dict
        The rows of results/detections.csv.
    index : mapping of str to mapping
        Rows of results/recordings.csv.
    rules : mapping
        Section ``evaluation`` of the configuration.
    """
    table = read_table(predictions)
    judged = table[table["scheme"] == choosing_scheme(rules["schemes"])]
    verdicts = pd.concat([judged, pd.DataFrame(detections)])
    rows: list[dict[str, Any]] = site_table(verdicts, index, rules["specificity"]).to_dict(
        "records"
    )
    return rows


def read_printed(path: Path) -> dict[str, Any]:
    """Read paper.yaml, the numbers that the paper prints."""
    printed: dict[str, Any] = yaml.safe_load(path.read_text(encoding="utf-8"))
    return printed
