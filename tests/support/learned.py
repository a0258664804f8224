"""Make the files that judging new recordings needs, from a few passages."""

from dataclasses import replace

import numpy as np

from capsule.detectors import files as detectors_files
from capsule.detectors.base import TrainingArchive
from capsule.detectors.familiar import FAMILIAR, FamiliarKind
from capsule.detectors.search import Passage
from capsule.detectors.shipped import Diagonal, Taught
from capsule.detectors.wave import wave_of
from capsule.detectors.wave_traits import wave_traits
from capsule.phantom.files import DEFAULT_TABLE, read_phantom
from capsule.phantom.simulation import simulate_run
from support.training import NO_TEMPLATES, TAUGHT, recordings_of


def taught_by(healthy_scores=(0.1, 0.2)):
    """Return an archive of a few invented passages that teaches the detectors."""
    place, usual = (1, 1, 130), (0.1, 0.1, 0.1)
    passages = {
        f"0mm/{n}": Passage(score, 0, 0, 0, *place, *usual)
        for n, score in enumerate(healthy_scores)
    }
    passages |= {f"3mm/{n}": Passage(3.0 + n, n, n, n, *place, *usual) for n in range(3)}
    sizes = {name: float(name[0]) for name in passages}
    passages["unlabelled/n"] = Passage(9.0, 1, 1, 1, 4.5, 128, 130, 0.1, 0.1, 0.1)
    rules = {"specificity": 0.95, "prevalence": 0.1, "size_confidence": 0.9}
    settings = {"evaluation": rules, "diagonal": {"size_ridge": 2.0}, "taught": TAUGHT}
    return TrainingArchive(sizes, recordings_of(passages), NO_TEMPLATES, {}, settings)


def write_templates(folder):
    """Write templates with one shape, for the size 3 mm."""
    shape = np.zeros((4, 1000))
    for sensor in range(4):
        shape[sensor, 150 + 100 * sensor : 250 + 100 * sensor] = 1.0
    np.savez(folder / "templates.npz", **{"0mm": np.zeros((4, 1000)), "3mm": shape})


def write_learned(folder, configuration, archive, **changes):
    """Write the trained detectors of an archive, with changed settings of `diagonal`."""
    settings = {"diagonal": configuration["diagonal"] | changes}
    templates = folder / "templates.npz"
    if not templates.exists():
        write_templates(folder)
    models = [each.taught(archive).stored() for each in (Diagonal, Taught)]
    models.append({FAMILIAR: FamiliarKind.taught(archive).stored()})
    learned = {key: value for each in models for key, value in each.items()}
    detectors_files.write_learned(folder / "detectors.json", learned, settings, templates)


def teach_familiar(folder, runs, configuration):
    """Write what simulated runs teach as familiar into `folder`/detectors.json, which exists."""
    bench = configuration["diagonal"]
    waves = {name: wave_of(run, 10.0, bench) for name, run in runs.items()}
    traits = {name: wave_traits(wave, 10.0) for name, wave in waves.items()}
    recordings = recordings_of(traits=traits)
    archive = replace(taught_by(), sizes_mm=dict.fromkeys(traits, 0.0), recordings=recordings)
    kind = {FAMILIAR: FamiliarKind.taught(archive).stored()}
    content = detectors_files.read_learned(folder / "detectors.json")
    made_from = content["settings"], folder / "templates.npz"
    detectors_files.write_learned(folder / "detectors.json", content | kind, *made_from)


def healthy_runs(count):
    """Return the readings of simulated runs over no nodule, by name."""
    phantom = read_phantom(DEFAULT_TABLE, [])
    names = [f"0mm/{number}" for number in range(count)]
    return {name: simulate_run(phantom, 0.0, 1, name).counts.astype(float) for name in names}
