"""Make the tables by which a reader judges the detectors, from their predictions."""

import argparse
import json
from pathlib import Path

import files
from capsule.folds import group_scheme
from capsule.judging import COLUMNS, tables


def main() -> None:
    """Read the predictions of all detectors, write the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--recordings", type=Path, required=True, help="recordings.csv")
    parser.add_argument("--predictions", type=Path, nargs="+", required=True, help="predictions")
    parser.add_argument("--settings", type=json.loads, required=True, help="config section, JSON")
    parser.add_argument("--output", type=Path, required=True, help="output: the folder of tables")
    arguments = parser.parse_args()
    rules = arguments.settings["evaluation"]
    level, seed, repeats = rules["confidence"], rules["seed"], rules["bootstrap"]
    prevalence = rules["prevalence"]
    headers = {row["recording"]: row for row in files.read_csv(arguments.recordings)}
    sites = {name: row["site"] for name, row in headers.items()}
    places = {name: tables.number(row["nodule_at_mm"]) for name, row in headers.items()}
    made: dict[str, list[dict]] = {name: [] for name in COLUMNS}
    by_scheme: dict[str, list[tables.Verdicts]] = {}
    predictions = [row for path in arguments.predictions for row in files.read_csv(path)]
    for verdicts in tables.collect(predictions):
        by_scheme.setdefault(verdicts.key["scheme"], []).append(verdicts)
        areas, points = tables.curves(verdicts, seed, repeats, level)
        bins = rules["calibration_bins"]
        stated, brier = tables.calibrated(verdicts, prevalence, bins, level)
        parts = {
            "auc": areas,
            "roc": points,
            "predictive_values": tables.predictive(verdicts, prevalence, level),
            "calibration": stated,
            "brier": brier,
            "size_error": tables.size_errors(verdicts, level),
            "localisation": tables.localisation(verdicts, places, level),
            "permutation": tables.permutation(verdicts, seed, rules["permutations"], level),
            "retest": [],
        }
        if verdicts.key["scheme"] == group_scheme("site"):
            passes, wanted = rules["passes"], rules["specificity"]
            parts["retest"] = tables.retests(verdicts, sites, passes, wanted, level)
        for name, rows in parts.items():
            made[name] += rows
    made["comparison"] = [
        row
        for of_scheme in by_scheme.values()
        for row in tables.comparisons(of_scheme, rules["tolerance_mm"], level)
    ]
    made["summary"] = [
        row
        for each in by_scheme.values()
        for row in tables.summary(each, rules["tolerance_mm"], level)
    ]
    for name, rows in made.items():
        columns = list(rows[0]) if rows else COLUMNS[name]
        files.write_csv(arguments.output / f"{name}.csv", columns, rows)


if __name__ == "__main__":
    files.run(main)
