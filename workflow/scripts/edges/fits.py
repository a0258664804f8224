"""Read the fits that belong to the accepted recordings, and no others."""

from pathlib import Path

import numpy as np

from capsule.errors import CapsuleError
from capsule.naming import size_mm
from capsule.particles import Particle
from edges import files


def read_particles(recordings: Path, folder: Path) -> dict[str, Particle]:
    """Read the optimal particle of every accepted recording of a nodule.

    Parameters
    ----------
    recordings : Path
        results/recordings.csv; a fit on disk whose recording is not accepted there is not read.
    folder : Path
        results/fits.

    Returns
    -------
    dict of str to Particle
        By the recording's name, in the order of recordings.csv.

    Raises
    ------
    CapsuleError
        There is none, so there is nothing to make a template from.
    """
    particles = {}
    for name in files.accepted_recordings(recordings):
        if size_mm(name):
            parameters = files.read_json(folder / f"{name}.json")["parameters"]
            arrays = {key: np.array(value) for key, value in parameters.items()}
            particles[name] = Particle(**arrays)
    if not particles:
        rejected = [row for row in files.read_csv(recordings) if row["status"] != "accepted"]
        raise CapsuleError(
            "no recording of a nodule can be used, so there is no template to compare with; put "
            "some into raw/, in folders such as 3mm/"
            + "".join(f"\n  rejected: raw/{row['recording']}: {row['reason']}" for row in rejected)
        )
    return particles


def by_size(particles: dict[str, Particle]) -> dict[float, list[Particle]]:
    """Group particles by the true size of their recordings, in mm."""
    groups: dict[float, list[Particle]] = {}
    for name, particle in particles.items():
        groups.setdefault(size_mm(name), []).append(particle)
    return groups
