"""Compute results that depend on numpy, from recordings in raw/, and save them to a file.

`test_numpy_versions.py` runs this program with several versions of numpy. It needs only numpy.
"""

import json
import sys
from pathlib import Path

import numpy as np

from capsule.method.nearest_template import template_distances
from capsule.method.particle import ParameterSpace, fit_particle
from capsule.method.preprocessing import preprocess
from capsule.method.templates import build_templates
from capsule.recordings.acceptance import readings_of
from capsule.recordings.recording import read_recording
from capsule.seeding import fit_generator

RAW = Path(__file__).parents[2] / "raw"
SIZES = range(6)


def results(config: dict) -> dict[str, np.ndarray]:
    """Return the matrix, fit and distances of one recording of each size, and the templates."""
    sensors = config["recording"]["sensors"]
    max_bytes = int(config["recording"]["max_megabytes"] * 1e6)
    shape, settings = config["preprocessing"], dict(config["fit"])
    counts = {key: settings.pop(key) for key in ("particles", "iterations", "first_peak")}
    seed, found, particles = settings.pop("seed"), {}, {}
    for size in SIZES:
        name = f"{size}mm/r01"
        with (RAW / f"{name}.csv").open("rb") as stream:
            recording = read_recording(stream, sensors, max_bytes)
        values, _ = readings_of(recording, config)
        found[f"matrix {name}"] = preprocess(values, **shape)
        if size:
            numbers, space = fit_generator(seed, values), ParameterSpace(**settings)
            fit = fit_particle(found[f"matrix {name}"], numbers, **counts, space=space)
            found[f"fit {name}"] = np.array(
                [*fit.particle.to_vector(), fit.rmse_initial, fit.rmse, fit.lag, fit.accepted_moves]
            )
            particles[float(size)] = [fit.particle]
    templates = build_templates(
        particles, sensors=sensors, first_peak=counts["first_peak"], length=shape["length"]
    )
    found["templates"] = np.array(templates.matrices)
    found["distances"] = np.array(
        [template_distances(found[f"matrix {s}mm/r01"], templates.matrices) for s in SIZES]
    )
    return found


if __name__ == "__main__":
    np.savez(sys.argv[1], version=np.__version__, **results(json.loads(sys.argv[2])))
