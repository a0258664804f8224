"""The verdicts of the configured detectors on the recordings of an archive, as table rows."""

from collections.abc import Iterator, Mapping, Sequence
from itertools import groupby

import numpy as np

from capsule.arrays import IntArray
from capsule.detectors.registry import detector_row
from capsule.detectors.training import Detector, TrainingArchive, detector_class
from capsule.detectors.verdicts import NO_VERDICT, Verdict, why_unknown
from capsule.evaluation.folds import Folds
from capsule.evaluation.rows import in_order
from capsule.kinds import Cells, Spread
from capsule.naming import size_label

# Some folds: for each its schemes, the recordings that are judged and those left out.
Part = list[tuple[list[str], IntArray, IntArray]]

# Recordings whose folds are one part. Neighbouring folds share what they compute.
_TOGETHER = 512
_COLUMNS = (
    "score",
    "threshold",
    "probability",
    "estimate_mm",
    "estimate_low_mm",
    "estimate_high_mm",
    "location_s",
    "location_mm",
    "no_verdict",
)


class Detectors:
    """The configured detectors, taught by the labelled recordings of an archive.

    Parameters
    ----------
    archive : TrainingArchive
        The archive. Its settings also hold the section ``recording`` and the list ``detectors``.

    Attributes
    ----------
    names : list of str
        The detectors, in the order of the configuration.
    columns : list of str
        The columns of a row besides recording and detector: the verdict, the distance to each
        template, and the other results. A detector that does not use distances has None there.
        ``no_verdict`` is the reason for no verdict.

    Raises
    ------
    CapsuleError
        The configuration names a detector that does not exist.
    """

    def __init__(self, archive: TrainingArchive) -> None:
        self.names = list(archive.settings["detectors"])
        self._archive = archive
        self._detectors = {name: detector_class(name)(archive) for name in self.names}
        self._distances = [f"rmse_{size_label(size)}" for size in archive.templates.sizes_mm]
        self.columns = ["predicted_mm", *self._distances, *_COLUMNS]

    def rows(self, names: Sequence[str], left_out: Sequence[str]) -> Iterator[Cells]:
        """Yield each detector's verdict on some recordings; those left out teach nothing."""
        models = {name: each.without(left_out) for name, each in self._detectors.items()}
        for name in names:
            recording, reason = self._archive.recording(name), self._archive.no_verdict.get(name)
            for detector, model in models.items():
                verdict = NO_VERDICT if reason else model.verdict(recording)
                row = self._row(name, detector, verdict)
                yield row | {"no_verdict": reason or why_unknown(verdict)}

    def learners(self) -> dict[str, Detector]:
        """Return by name the detectors that learn a threshold and can learn it anew quickly."""
        rows = {name: detector_row(name) for name in self.names}
        return {
            name: self._detectors[name]
            for name, row in rows.items()
            if row.fixed_threshold is None and not row.by_templates
        }

    def stored(self) -> Cells:
        """Return the models that all labelled recordings teach, to judge other recordings."""
        content: Cells = {"recordings": len(self._archive.sizes_mm)}
        for detector in self._detectors.values():
            content |= detector.without([]).stored()
        return content

    def _row(self, name: str, detector: str, verdict: Verdict) -> Cells:
        rate_hz = self._archive.settings["recording"]["rate_hz"]
        row = {"recording": name, "detector": detector, **verdict_cells(verdict, rate_hz)}
        distances = verdict.distances or [None] * len(self._distances)
        return row | dict(zip(self._distances, distances, strict=True))


def verdict_cells(verdict: Verdict, rate_hz: float) -> Cells:
    """Return the cells of a verdict without its distances; the location is in seconds."""
    cells = dict(vars(verdict))
    del cells["distances"]
    cells["location_s"] = cells.pop("location_samples") / rate_hz
    return cells


def by_folds(
    detectors: Detectors,
    sizes_mm: Mapping[str, float],
    schemes: Sequence[Folds],
    spread: Spread = map,
) -> list[Cells]:
    """Return the verdicts on recordings of known size, each from its own training fold.

    Parameters
    ----------
    detectors : Detectors
        The detectors, taught by the same recordings.
    sizes_mm : mapping of str to float
        The recordings and their true sizes.
    schemes : sequence of Folds
        The folds of these recordings, in the same order, under each scheme.
    spread : callable
        Calls a function with each part of the work, like `map`. No part needs the results of
        another.

    Returns
    -------
    list of dict
        One row for each detector, recording and scheme, in this order: the rows of
        `Detectors.rows` with ``size_mm`` and ``scheme``.
    """
    names = list(sizes_mm)

    def judge(part: Part) -> list[Cells]:
        rows = []
        for of_schemes, *indices in part:
            judged, left_out = ([names[index] for index in each] for each in indices)
            for row in detectors.rows(judged, left_out):
                row |= {"size_mm": sizes_mm[row["recording"]]}
                rows += [row | {"scheme": scheme} for scheme in of_schemes]
        return rows

    rows = [row for judged in spread(judge, parts_of(schemes)) for row in judged]
    order = [folds.scheme for folds in schemes]
    return in_order(rows, detector=detectors.names, recording=names, scheme=order)


def parts_of(schemes: Sequence[Folds]) -> list[Part]:
    """Divide all folds into parts that can be judged side by side.

    A fold stays whole, because learning without its recordings is the work; a fold of several
    schemes is judged once. If nothing is left out, nothing is learned, and each part judges the
    recordings that its folds judge, too.

    Parameters
    ----------
    schemes : sequence of Folds
        The folds of the same recordings under each scheme.

    Returns
    -------
    list of list of (list of str, array, array)
        Schemes, and the places of the recordings that are judged and that are left out.
    """
    same: dict[tuple[bytes, bytes], tuple[list[str], IntArray, IntArray]] = {}
    for folds in schemes:
        for judged, left_out in folds.parts():
            of_schemes, *_ = same.setdefault(
                (judged.tobytes(), left_out.tobytes()), ([], judged, left_out)
            )
            of_schemes.append(folds.scheme)
    if not same:
        return []
    listed = list(same.values())
    part_of = np.full(1 + max(int(judged.max()) for _, judged, _ in listed), -1)
    sizes = [0]
    for _, judged, left_out in listed:
        if left_out.size and part_of[judged[0]] < 0:
            if sizes[-1] >= _TOGETHER:
                sizes.append(0)
            part_of[judged] = len(sizes) - 1
            sizes[-1] += judged.size
    if part_of[0] < 0:
        part_of = np.arange(part_of.size) // _TOGETHER
    parts: list[Part] = [[] for _ in range(int(part_of.max()) + 1)]
    for of_schemes, judged, left_out in listed:
        if left_out.size:
            parts[part_of[judged[0]]].append((of_schemes, judged, left_out))
        else:
            for number in np.unique(part_of[judged]):
                chosen = judged[part_of[judged] == number]
                parts[number].append((of_schemes, chosen, left_out))
    return parts


def of_unlabelled(
    detectors: Detectors, names: Sequence[str], near_copies: Mapping[str, Sequence[str]]
) -> list[Cells]:
    """Return the verdicts on unlabelled recordings; all labelled recordings teach.

    Parameters
    ----------
    detectors : Detectors
        The detectors, taught by the labelled recordings.
    names : sequence of str
        The unlabelled recordings.
    near_copies : mapping of str to sequence of str
        Labelled near-copies of some of these; they do not teach when it is judged.

    Returns
    -------
    list of dict
        The rows of `Detectors.rows`.
    """
    by_what_is_left_out = groupby(names, lambda name: near_copies.get(name, ()))
    return [
        row
        for left_out, judged in by_what_is_left_out
        for row in detectors.rows(list(judged), left_out)
    ]
