"""One simulated archive and what every detector says of it: the only place that calls detectors.

Rows hold plain numbers by the name of their column, so that whoever averages or writes them knows
nothing of detectors.
"""

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
import pandas as pd
from judge_rates import mean_or_unknown, rates
from phantom_study.simulated_archive import (
    SIZES_MM,
    DetectorSettings,
    archive_matrices,
    average_fits,
    fit_archive,
)

from capsule.detectors.base import Detector, StoredRecording, TrainingArchive, Verdict
from capsule.detectors.registry import detector_class
from capsule.detectors.search import passage_of
from capsule.evaluation import intervals
from capsule.evaluation.columns import SITES
from capsule.evaluation.sites import detections_by_passes
from capsule.method.templates import TemplateSet, no_nodule_template
from capsule.phantom.parameters import Phantom
from capsule.phantom.simulation import Run, planned_runs, simulate_run
from capsule.seeding import generator

RUNS = 20


@dataclass(frozen=True)
class Recording:
    """A simulated recording: its name such as ``3mm/r07p1``, its site, its label and its run."""

    name: str
    site: str
    size_mm: float
    run: Run


def simulate_archive(phantom: Phantom, seed: int, passes: int = 1) -> list[Recording]:
    """Simulate 20 sites of each size, with some passes over each."""
    return [
        Recording(
            f"{planned.site}p{planned.attempt}",
            planned.site,
            float(planned.size_mm),
            simulate_run(phantom, planned.size_mm, seed, planned.site, planned.attempt),
        )
        for planned in planned_runs(SIZES_MM, RUNS, passes)
    ]


def dealt_anew(archive: Sequence[Recording], seed: int) -> list[Recording]:
    """Return the recordings with their labels dealt out anew by chance."""
    dealt = generator(seed, "labels").permutation(_sizes(archive))
    return [
        replace(recording, size_mm=float(size_mm))
        for recording, size_mm in zip(archive, dealt, strict=True)
    ]


def search_archive(archive: Sequence[Recording], config: Mapping) -> TrainingArchive:
    """Search all recordings of an archive; the diagonal detector needs nothing else of them."""
    rate_hz = config["recording"]["rate_hz"]
    return TrainingArchive(
        sizes_mm={recording.name: recording.size_mm for recording in archive},
        recordings={
            each.name: StoredRecording(
                {}.popitem,
                passage_of(each.run.counts.astype(float), rate_hz, config["diagonal"]),
            )
            for each in archive
        },
        templates=TemplateSet((0.0,), (), (no_nodule_template(1, 1),), 1),
        particles={},
        settings=config,
    )


def judge_diagonal(
    archive: Sequence[Recording], config: Mapping
) -> tuple[dict[str, float], TrainingArchive]:
    """Judge each recording by what the others of its archive teach.

    Returns
    -------
    row : dict of str to float
        The rates, the errors of size and place, and the seconds of CPU time.
    searched : TrainingArchive
        With which another archive may be judged.
    """
    started = time.process_time()
    searched = search_archive(archive, config)
    detector = detector_class("diagonal")
    verdicts = [
        detector.taught(searched, [each.name]).verdict(searched.recordings[each.name])
        for each in archive
    ]
    seconds = time.process_time() - started
    return _diagonal_row(archive, verdicts) | {"seconds": seconds}, searched


def learn_diagonal(searched: TrainingArchive) -> Detector:
    """Learn from all recordings of an archive."""
    return detector_class("diagonal").taught(searched)


def judge_by_another(
    archive: Sequence[Recording], searched: TrainingArchive, teacher: Detector
) -> dict[str, float]:
    """Judge an archive's searched recordings by what another archive taught.

    Nothing was set up for both: neither the nodules nor the capsule.
    """
    verdicts = [teacher.verdict(searched.recordings[recording.name]) for recording in archive]
    return _diagonal_row(archive, verdicts)


def judge_template(
    archive: Sequence[Recording], config: Mapping, effort: int, seed: int
) -> dict[str, dict[str, float]]:
    """Judge each recording by the paper's detector.

    Parameters
    ----------
    archive
        The recordings.
    config
        The project's configuration.
    effort
        Number of particles and of iterations of each fit.
    seed
        Of the fits.

    Returns
    -------
    dict of str to dict
        A row for ``template``.
    """
    started = time.process_time()
    fit = {**config["fit"], "seed": seed, "particles": effort, "iterations": effort}
    settings = DetectorSettings(config["preprocessing"], fit)
    matrices = archive_matrices({each.name: each.run for each in archive}, settings)
    particles = fit_archive(matrices, settings)
    templates = average_fits(particles, settings, config["preprocessing"]["length"])
    sizes_mm = {recording.name: recording.size_mm for recording in archive}
    recordings = {name: StoredRecording(partial(matrices.__getitem__, name)) for name in sizes_mm}
    taught = TrainingArchive(sizes_mm, recordings, templates, particles, config)
    detector = detector_class("template")
    verdicts = [
        detector.taught(taught, [name]).verdict(taught.recordings[name]) for name in sizes_mm
    ]
    return {"template": _row(archive, verdicts) | {"seconds": time.process_time() - started}}


def judge_passes(archive: Sequence[Recording], config: Mapping) -> dict[int, dict[float, float]]:
    """Judge the first passes over each site together, by the diagonal detector's mean score.

    Returns
    -------
    dict of int to dict
        For each number of passes, the share of sites of each size where a nodule is detected.
    """
    searched, judged = search_archive(archive, config), config["evaluation"]
    rows = [
        dict.fromkeys(SITES, np.nan)
        | {"site": recording.site, "size_mm": recording.size_mm}
        | {"score": searched.recordings[recording.name].passage.evidence}
        for recording in archive
    ]
    shares = {}
    for count in judged["passes"]:
        made = detections_by_passes(pd.DataFrame(rows), "diagonal", count, judged["specificity"])
        shares[count] = made.groupby("size_mm")["detected"].mean().to_dict()
    return shares


def _sizes(archive: Sequence[Recording]) -> np.ndarray:
    return np.array([recording.size_mm for recording in archive])


def _row(archive: Sequence[Recording], verdicts: Sequence[Verdict]) -> dict[str, float]:
    """Return what every detector's table shows."""
    true_mm = _sizes(archive)
    scores = np.array([verdict.score for verdict in verdicts])
    row = rates(true_mm, np.array([verdict.predicted_mm for verdict in verdicts]))
    return row | {"AUC of 1 mm": intervals.auc(scores[true_mm == 0], scores[true_mm == 1])}


def _diagonal_row(archive: Sequence[Recording], verdicts: Sequence[Verdict]) -> dict[str, float]:
    """Return what the diagonal detector's table shows: errors of size and place, too."""
    true_mm = _sizes(archive)
    estimate_mm = np.array([verdict.estimate_mm for verdict in verdicts])
    location_mm = np.array([verdict.location_mm for verdict in verdicts])
    nodule_at_mm = np.array([recording.run.nodule_at_mm for recording in archive])
    sized = ~np.isnan(estimate_mm) & (true_mm >= 2)
    away = np.abs(location_mm - nodule_at_mm)[sized]
    return _row(archive, verdicts) | {
        "size estimate's error (mm)": mean_or_unknown(np.abs(estimate_mm - true_mm)[sized]),
        "place's error, median (mm)": float(np.median(away)) if away.size else float("nan"),
    }
