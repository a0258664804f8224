"""Judge every place that was passed several times by all its recordings together."""

import argparse
import json
from pathlib import Path

import numpy as np

import files
from capsule.folds import group_scheme, main_scheme
from capsule.judging.sites import Passes, SiteVerdict, site_verdicts

COLUMNS = ["site", "size_mm", "recordings", "detector", *SiteVerdict.__annotations__]


def passes_of(rows: list[dict], sites: dict[str, str]) -> dict[str, dict[str, Passes]]:
    """Sort verdicts by detector and place; a recording that names none is a place by itself."""
    sorted_rows: dict[str, dict[str, list[dict]]] = {}
    for row in rows:
        # The same place with other labels is another place.
        site = f"{sites[row['recording']] or row['recording']}\n{row.get('size_mm', '')}"
        sorted_rows.setdefault(row["detector"], {}).setdefault(site, []).append(row)
    columns = ("score", "estimate_mm", "location_mm")
    return {
        detector: {
            site: Passes(
                float(group[0].get("size_mm") or "nan"),
                *(np.array([float(row[column] or "nan") for row in group]) for column in columns),
            )
            for site, group in by_site.items()
        }
        for detector, by_site in sorted_rows.items()
    }


def main() -> None:
    """Read the verdicts on labelled and unlabelled recordings, write one row a place."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--recordings", type=Path, required=True, help="recordings.csv")
    parser.add_argument("--evaluation", type=Path, required=True, help="the folder of predictions")
    parser.add_argument("--detections", type=Path, required=True, help="detections.csv")
    parser.add_argument("--settings", type=json.loads, required=True, help="config section, JSON")
    parser.add_argument("--output", type=Path, required=True, help="output: sites.csv")
    arguments = parser.parse_args()
    rules = arguments.settings["evaluation"]
    sites = {row["recording"]: row["site"] for row in files.read_csv(arguments.recordings)}
    said = files.read_csv(arguments.evaluation / "group_predictions.csv")
    labelled = [row for row in said if row["scheme"] == group_scheme("site")]
    if not labelled:  # no labelled place was passed twice
        said = files.read_csv(arguments.evaluation / "predictions.csv")
        labelled = [row for row in said if row["scheme"] == main_scheme(rules["schemes"])]
    rows = []
    every = passes_of(labelled + files.read_csv(arguments.detections), sites)
    for detector, by_site in every.items():
        wanted = None if detector == "template" else rules["specificity"]
        for site, verdict in site_verdicts(by_site, wanted).items():
            passes = by_site[site]
            row = {"site": site.partition("\n")[0], "size_mm": passes.size_mm}
            row |= {"recordings": passes.score.size, "detector": detector}
            rows.append(row | vars(verdict))
    files.write_csv(arguments.output, COLUMNS, rows)
    print(f"{len({row['site'] for row in rows})} places were passed several times")


if __name__ == "__main__":
    files.run(main)
