"""Fit a particle to one recording's matrix; a rejected recording gets a fit without parameters."""

import argparse
import json
from pathlib import Path

import numpy as np

from capsule.fitting import fit_particle
from capsule.naming import size_mm
from capsule.particles import ParameterSpace
from capsule.seeding import fit_generator
from edges import files


def main() -> None:
    """Read a matrix, and the readings that seed its fit; write the optimal parameter set."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("matrix", type=Path, help="the matrix, .npy")
    parser.add_argument("--signal", type=Path, required=True, help="the readings, .npy")
    parser.add_argument("--name", required=True, help="the recording's name, such as 3mm/r07")
    parser.add_argument("--settings", type=json.loads, required=True, help="config section, JSON")
    parser.add_argument("--output", type=Path, required=True, help="output: the fit, .json")
    arguments = parser.parse_args()
    settings = dict(arguments.settings["fit"])
    seed = settings.pop("seed")
    counts = {key: settings.pop(key) for key in ("particles", "iterations", "first_peak")}
    result = {"recording": arguments.name, "size_mm": size_mm(arguments.name), "seed": seed}
    result |= {"first_peak": counts["first_peak"], "parameters": None}
    result |= dict.fromkeys(("rmse_initial", "rmse", "lag", "accepted_moves"))
    matrix = np.load(arguments.matrix)
    if not np.isnan(matrix).any():
        numbers = fit_generator(seed, np.load(arguments.signal))
        fit = fit_particle(matrix, numbers, **counts, space=ParameterSpace(**settings))
        result["parameters"] = {key: value.tolist() for key, value in vars(fit.particle).items()}
        result |= {key: value for key, value in vars(fit).items() if key != "particle"}
        print(f"{arguments.name}: RMSE {fit.rmse_initial:.5f} -> {fit.rmse:.5f}")
    files.write_json(arguments.output, result)


if __name__ == "__main__":
    files.run(main)
