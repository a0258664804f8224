"""Compare the unlabelled recordings with the templates."""

import argparse
from pathlib import Path

import numpy as np

import files
from capsule.detection import nearest_size, template_distances
from capsule.naming import folder_size_mm, size_mm


def main() -> None:
    """Write detections.csv: the predicted size and the distance to each template."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--recordings", type=Path, required=True, help="recordings.csv")
    parser.add_argument("--matrices", type=Path, required=True, help="the folder of matrices")
    parser.add_argument("--templates", type=Path, required=True, help="templates.npz")
    parser.add_argument("--output", type=Path, required=True, help="output: detections.csv")
    arguments = parser.parse_args()
    with np.load(arguments.templates) as stored:
        templates = dict(stored)
    sizes_mm = [folder_size_mm(label) for label in templates]
    labels = [f"rmse_{label}" for label in templates]
    rows = []
    for name in files.accepted_recordings(arguments.recordings):
        if size_mm(name) is None:
            matrix = np.load(arguments.matrices / f"{name}.npy")
            distances = template_distances(matrix, list(templates.values()))
            row = {"recording": name, "detector": "template"}
            row["predicted_mm"] = nearest_size(distances, sizes_mm)
            rows.append(row | dict(zip(labels, distances.tolist(), strict=True)))
    columns = ["recording", "detector", "predicted_mm", *labels]
    files.write_csv(arguments.output, columns, rows)
    print(f"{len(rows)} unlabelled recordings compared with {len(templates)} templates")


if __name__ == "__main__":
    files.run(main)
