"""Fit a particle to one recording's matrix; a rejected recording gets a fit without parameters."""

import argparse
import json
from pathlib import Path

import numpy as np

from capsule.fitting import fit_recording
from capsule.kinds import Settings
from capsule.naming import size_mm
from edges import files


def fit_matrix(
    matrix_file: Path, signal: Path, name: str, settings: Settings, output: Path
) -> None:
    """Read a matrix and the readings that seed its fit, and write the optimal parameters."""
    options = settings["fit"]
    result = {"recording": name, "size_mm": size_mm(name)}
    result |= {key: options[key] for key in ("seed", "first_peak")} | {"parameters": None}
    result |= dict.fromkeys(("rmse_initial", "rmse", "lag", "accepted_moves"))
    matrix = np.load(matrix_file)
    if not np.isnan(matrix).any():
        fit = fit_recording(matrix, np.load(signal), options)
        result["parameters"] = {key: value.tolist() for key, value in vars(fit.particle).items()}
        result |= {key: value for key, value in vars(fit).items() if key != "particle"}
        print(f"{name}: RMSE {fit.rmse_initial:.5f} -> {fit.rmse:.5f}")
    files.write_json(output, result)


def main() -> None:
    """Read the arguments of one recording, and fit its matrix."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("matrix", type=Path, help="the matrix, .npy")
    parser.add_argument("--signal", type=Path, required=True, help="the readings, .npy")
    parser.add_argument("--name", required=True, help="the recording's name, such as 3mm/r07")
    parser.add_argument("--settings", type=json.loads, required=True, help="config section, JSON")
    parser.add_argument("--output", type=Path, required=True, help="output: the fit, .json")
    arguments = parser.parse_args()
    fit_matrix(
        arguments.matrix, arguments.signal, arguments.name, arguments.settings, arguments.output
    )


if __name__ == "__main__":
    files.run(main)
