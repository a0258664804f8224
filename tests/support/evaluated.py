"""Make rates and tables from a few verdicts, for tests of the report."""

import pandas as pd

from capsule.evaluation.beside_paper import Evaluation
from capsule.evaluation.files import read_printed
from capsule.evaluation.paper import printed_tables
from capsule.evaluation.rates import COLUMNS, tables
from support.project import ROOT

UNKNOWN = float("nan")
RATES = {"schemes": ["leave_one_out"], "tolerance_mm": 1.0, "confidence": 0.95}
SETTINGS = {
    "fit": {"seed": 1},
    "evaluation": {**RATES, "specificity": 0.95, "size_confidence": 0.9},
    "report": {"reliable_rate": 0.85, "lead": "best"},
}


DETECTIONS = pd.DataFrame(columns=["recording", "detector", "predicted_mm", "rmse_0mm"])


def read_paper():
    """Read the numbers that the paper prints."""
    return read_printed(ROOT / "workflow" / "report" / "paper.yaml")


def evaluated(verdicts, sizes_mm=(0.0, 2.0, 3.0), detectors=("template",)):
    """Return the evaluation of triples (recording, true size, predicted size), with the paper's."""
    rows = [
        {
            "recording": name,
            "size_mm": true,
            "detector": detector,
            "scheme": "leave_one_out",
            "predicted_mm": predicted,
            **{f"rmse_{size:g}mm": abs(predicted - size) / 10 for size in sizes_mm},
        }
        for detector in detectors
        for name, true, predicted in verdicts
    ]
    columns = ["recording", "size_mm", "detector", "scheme", "predicted_mm"]
    columns += [f"rmse_{size:g}mm" for size in sizes_mm]
    made = tables(rows, list(sizes_mm), **RATES)
    paper = {name: pd.DataFrame(rows) for name, rows in printed_tables(read_paper(), 0.95).items()}
    ours = {name: pd.DataFrame(table, columns=COLUMNS[name]) for name, table in made.items()}
    return Evaluation(pd.DataFrame(rows, columns=columns), ours, paper)


def index_of(*rows):
    """Return the table of results/recordings.csv, made from rows."""
    columns = ["recording", "size_mm", "status", "reason", "source", "sha256", "duration_s"]
    frame = pd.DataFrame(rows, columns=columns)
    return frame.assign(samples=100, near_copies=None, site=None, no_verdict=None)
