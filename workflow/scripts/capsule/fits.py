"""Read the fits of the recordings that can be judged."""

from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from capsule import files
from capsule.errors import CapsuleError
from capsule.held_out import teaching
from capsule.names import size_mm, sizes_of
from capsule.particle import Particle
from capsule.results import Results


def read_particles(
    recordings: Path, results: Results, held_out: Collection[str] = ()
) -> dict[str, Particle]:
    """Read the optimal particle of every recording of a nodule that teaches.

    Such a recording is accepted, shows a wave, and is not held out.

    Parameters
    ----------
    recordings : Path
        results/recordings.csv or results/labelled.csv. Fits of other recordings are not read.
    results : Results
        The files of the recordings.
    held_out : collection of str
        The key ``evaluation.held_out``: their recordings have no fits.

    Returns
    -------
    dict of str to Particle
        The particles by the recording's name, in the order of `files.accepted_recordings`.

    Raises
    ------
    CapsuleError
        There is no such recording, so no template can be made.
    """
    accepted = teaching(files.accepted_recordings(recordings), held_out)
    names = [name for name, row in accepted.items() if size_mm(name) and not row["no_verdict"]]
    if not names:
        listed = {row["recording"]: row for row in files.read_csv(recordings)}
        judging = listed.keys() - teaching(listed, held_out).keys()
        rows = [(name, _why_not(row, name in judging)) for name, row in listed.items()]
        raise CapsuleError(
            "no recording of a nodule can be used, so no template can be made; put recordings of "
            "nodules into folders such as raw/3mm/"
            + "".join(f"\n  {why[0]}: raw/{name}: {why[1]}" for name, why in rows if why)
        )
    fits = results.fits(names)
    return {name: particle_of(fits[name]) for name in names}


def by_size(particles: Mapping[str, Particle]) -> dict[float, list[Particle]]:
    """Group particles by the true size of their recordings, in mm."""
    groups: dict[float, list[Particle]] = {}
    for name, size in sizes_of(particles).items():
        groups.setdefault(size, []).append(particles[name])
    return groups


def particle_of(fit: Mapping[str, Any]) -> Particle:
    """Return Theta* of a fit that has parameters."""
    return Particle(**{name: np.array(values) for name, values in fit["parameters"].items()})


def _why_not(row: Mapping[str, str], held_out: bool) -> tuple[str, str] | None:
    if row["status"] != "accepted":
        return "rejected", row["reason"]
    if held_out:
        return "held out", f"evaluation.held_out names its session {row['session']}"
    return ("not judged", row["no_verdict"]) if row["no_verdict"] else None
