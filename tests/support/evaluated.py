"""Make rates and tables from a few verdicts, for tests of the report."""

import numpy as np
import pandas as pd

from capsule.evaluation.files import read_printed
from capsule.evaluation.measures import measure_tables
from capsule.evaluation.paper import Evaluation, printed_tables
from support.project import ROOT
from support.verdicts import index_of as rows_of
from support.verdicts import verdicts

UNKNOWN = float("nan")
RULES = {"schemes": ["leave_one_out"], "tolerance_mm": 1.0, "confidence": 0.95}
RULES |= {"specificity": 0.95, "size_confidence": 0.9, "prevalence": 0.1}
RULES |= {"calibration_bins": 5, "passes": [1, 2], "held_out": []}


def read_paper():
    """Read the numbers that the paper prints."""
    return read_printed(ROOT / "workflow" / "report" / "paper.yaml")


def evaluated(triples, sizes_mm=(0.0, 2.0, 3.0), detectors=("template",), scheme="leave_one_out"):
    """Return the evaluation of triples (recording, true size, predicted size), with the paper's."""
    names, pairs = [name for name, *_ in triples], [pair for _, *pair in triples]
    made = [verdicts(pairs, each, scheme, recording=names, threshold=0.0) for each in detectors]
    predictions = pd.concat(made, ignore_index=True)
    predicted_mm = predictions["predicted_mm"]
    predictions["verdict"] = np.where(predicted_mm > 0, "nodule", "no nodule")
    for size_mm in sizes_mm:
        predictions[f"rmse_{size_mm:g}mm"] = (predicted_mm - size_mm).abs() / 10
    ours = measure_tables(predictions, list(sizes_mm), RULES, rows_of(predictions))
    return Evaluation(predictions, ours, printed_tables(read_paper(), 0.95))


def index_of(*rows):
    """Return the table of results/recordings.csv, made from rows."""
    columns = ["recording", "size_mm", "status", "reason", "source", "sha256", "duration_s"]
    frame = pd.DataFrame(rows, columns=columns)
    empty = dict.fromkeys(("near_copies", "site", "session", "setup", "no_verdict"))
    return frame.assign(samples=100, **empty)
