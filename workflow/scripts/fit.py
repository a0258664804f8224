"""Fit a particle to the matrix of each recording of a batch.

A rejected recording gets a fit without parameters.
"""

import argparse
import json
from pathlib import Path

import numpy as np

from capsule.engine.jobs import run
from capsule.method.particle import fit_recording
from capsule.recordings.names import size_mm
from capsule.store import results


def main() -> None:
    """Read the matrices, and the readings that seed the fits, and write the optimal parameters."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("recordings", nargs="+", help="names such as 3mm/r07")
    parser.add_argument("--batch", required=True, help="the batch, such as 3mm/r07")
    parser.add_argument("--signals", type=Path, required=True, help="the readings")
    parser.add_argument("--matrices", type=Path, required=True, help="the matrices")
    parser.add_argument("--settings", type=json.loads, required=True, help="config section, JSON")
    parser.add_argument("--output", type=Path, required=True, help="output: the fits, .json")
    arguments = parser.parse_args()
    options, fits = arguments.settings["fit"], {}
    for name in arguments.recordings:
        fits[name] = {"recording": name, "size_mm": size_mm(name)}
        fits[name] |= {key: options[key] for key in ("seed", "first_peak")} | {"parameters": None}
        fits[name] |= dict.fromkeys(("rmse_initial", "rmse", "lag", "accepted_moves"))
        matrix = results.read_array(arguments.matrices, name)
        if np.isnan(matrix).any():
            continue
        fit = fit_recording(matrix, results.read_array(arguments.signals, name), options)
        parameters = {key: value.tolist() for key, value in vars(fit.particle).items()}
        found = {key: value for key, value in vars(fit).items() if key != "particle"}
        fits[name] |= {"parameters": parameters, **found}
        print(f"{name}: RMSE {fit.rmse_initial:.5f} -> {fit.rmse:.5f}")
    results.write_contents(arguments.output, fits, arguments.batch)


if __name__ == "__main__":
    run(main)
