"""Make rates and tables from a few verdicts, for tests of the report."""

import pandas as pd

from capsule.evaluation.archive_rates import Rates
from capsule.evaluation.files import read_printed
from capsule.evaluation.measures import measure_tables
from capsule.evaluation.paper import Evaluation, printed_tables
from support.project import ROOT

UNKNOWN = float("nan")
RATES = {"schemes": ["leave_one_out"], "tolerance_mm": 1.0, "confidence": 0.95}
RULES = {**RATES, "specificity": 0.95, "size_confidence": 0.9, "prevalence": 0.1}
RULES |= {"calibration_bins": 5, "passes": [1, 2], "held_out": []}
SETTINGS = {
    "fit": {"seed": 1},
    "evaluation": RULES,
    "report": {"reliable_rate": 0.85, "lead": "best"},
}


OF_SCORES = ("score", "threshold", "probability", "location_mm")
OF_SCORES += ("estimate_mm", "estimate_low_mm", "estimate_high_mm")
DETECTIONS = pd.DataFrame(columns=["recording", "detector", "predicted_mm", "rmse_0mm"])


def read_paper():
    """Read the numbers that the paper prints."""
    return read_printed(ROOT / "workflow" / "report" / "paper.yaml")


def evaluated(verdicts, sizes_mm=(0.0, 2.0, 3.0), detectors=("template",), scheme="leave_one_out"):
    """Return the evaluation of triples (recording, true size, predicted size), with the paper's."""
    rows = [
        {
            "recording": name,
            "size_mm": true,
            "detector": detector,
            "scheme": scheme,
            "predicted_mm": predicted,
            **dict.fromkeys(OF_SCORES, UNKNOWN),
            **{"score": predicted, "threshold": 0.0},
            "verdict": "nodule" if predicted else "no nodule",
            **{f"rmse_{size:g}mm": abs(predicted - size) / 10 for size in sizes_mm},
        }
        for detector in detectors
        for name, true, predicted in verdicts
    ]
    columns = ["recording", "size_mm", "detector", "scheme", "predicted_mm", *OF_SCORES, "verdict"]
    columns += [f"rmse_{size:g}mm" for size in sizes_mm]
    predictions = pd.DataFrame(rows, columns=columns)
    names = predictions["recording"].unique()
    blank = dict.fromkeys(("site", "session", "setup", "near_copies", "nodule_at_mm"), "")
    ours = measure_tables(predictions, list(sizes_mm), RULES, dict.fromkeys(names, blank))
    return Evaluation(predictions, ours, printed_tables(read_paper(), 0.95))


def rates_of(evaluation):
    """Return the rates of an evaluation in which each recording is a place."""
    labels = evaluation.predictions.drop_duplicates("recording")[["recording", "size_mm"]]
    rows = [[*label, "accepted", UNKNOWN, "bench", "aa", 70.0] for label in labels.values]
    return Rates(evaluation, index_of(*rows), SETTINGS)


def index_of(*rows):
    """Return the table of results/recordings.csv, made from rows."""
    columns = ["recording", "size_mm", "status", "reason", "source", "sha256", "duration_s"]
    frame = pd.DataFrame(rows, columns=columns)
    empty = dict.fromkeys(("near_copies", "site", "session", "setup", "no_verdict"))
    return frame.assign(samples=100, **empty)
