"""The schemes of the evaluation, and the verdicts of the detectors under each of them.

The unit that is left out is the place: all recordings of a site, and near copies. Recordings of a
held-out session teach nothing under any scheme.
"""

from collections import Counter
from collections.abc import Hashable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import islice
from math import ceil
from typing import TypeVar

from capsule.detectors.base import NO_VERDICT, Detector, TrainingArchive, Verdict, why_unknown
from capsule.detectors.familiar import FAMILIAR, Familiarity, FamiliarKind
from capsule.detectors.registry import detector_class
from capsule.detectors.verdicts import row_verdict
from capsule.evaluation.columns import DISTANCE
from capsule.kinds import Cells, Settings
from capsule.recordings.held_out import teaching
from capsule.recordings.names import size_label, size_mm
from capsule.recordings.origin import places_of

HELD_OUT = "held_out"
LEAVE_ONE_OUT = "leave_one_out"
RESUBSTITUTION = "resubstitution"
# Even the largest archive is divided into so many folds, so that nearly all of it teaches.
_FEWEST_FOLDS = 50
# Fewer sessions, or set-ups of a kind, say nothing about a further one.
LEAST_GROUPS = 3
# Without so many recordings of each kind, no detector learns what it needs.
LEAST_HEALTHY, LEAST_NODULES = 3, 1
# Rows of results/recordings.csv by recording.
Rows = Mapping[str, Mapping[str, str]]
_Group = TypeVar("_Group", bound=Hashable)


def group_scheme(key: str) -> str:
    """Return the name of the scheme that leaves out whole groups, such as sessions or setups."""
    return f"leave_one_{key}_out"


def choosing_scheme(schemes: Iterable[str]) -> str:
    """Return the scheme on which the detector that is shown first is chosen.

    Held-out sessions never choose.
    """
    others = [scheme for scheme in schemes if scheme != HELD_OUT]
    return LEAVE_ONE_OUT if LEAVE_ONE_OUT in others or not others else others[0]


def main_scheme(schemes: Iterable[str]) -> str:
    """Return the scheme whose numbers are the main result: held-out sessions, if there are any."""
    schemes = list(schemes)
    return HELD_OUT if HELD_OUT in schemes else choosing_scheme(schemes)


@dataclass(frozen=True)
class Fold:
    """One training fold of a scheme: the recordings that are judged, and those left out.

    What is left out teaches nothing. The judged recordings are left out, too, unless under
    resubstitution.
    """

    scheme: str
    judged: tuple[str, ...]
    left_out: frozenset[str]


def grouped(names: Iterable[str], group_of: Mapping[str, _Group]) -> dict[_Group, list[str]]:
    """Return the recordings of each group; groups and recordings keep the order of the names."""
    members: dict[_Group, list[str]] = {}
    for name in names:
        members.setdefault(group_of[name], []).append(name)
    return members


def folds_of(rows: Rows, rules: Settings) -> list[Fold]:
    """Return the training folds of all schemes that the archive allows.

    Their order is that of the schemes: held-out sessions, leave-one-out, groups, resubstitution.
    The rows are those of the accepted labelled recordings, and the rules section ``evaluation``.
    """
    taught, place = teaching(rows, rules["held_out"]), places_of(rows)
    apart = [name for name in rows if name not in taught]
    members, shared = grouped(rows, place), {place[name] for name in taught}
    together = _together(taught, place, rules["most_folds"])
    groups = {
        # A held-out recording at a place that teaches, too, has a fold of its own.
        HELD_OUT: {name: place[name] if place[name] in shared else "" for name in apart},
        LEAVE_ONE_OUT: together if LEAVE_ONE_OUT in rules["schemes"] else {},
        **{group_scheme(key): _header_groups(key, taught, together) for key in rules["groups"]},
        RESUBSTITUTION: dict.fromkeys(taught, "") if RESUBSTITUTION in rules["schemes"] else {},
    }
    folds = []
    for scheme, group_of in groups.items():
        for judged in grouped(group_of, group_of).values():
            # The places of the judged recordings teach nothing, nor does what is held out.
            own = () if scheme == RESUBSTITUTION else (members[place[name]] for name in judged)
            folds.append(Fold(scheme, tuple(judged), frozenset(apart).union(*own)))
    return folds


def _header_groups(key: str, rows: Rows, alone: Mapping[str, str]) -> dict[str, str]:
    """Return the group of each recording; empty if leaving groups out says nothing.

    There must be at least `LEAST_GROUPS` sessions; of the groups of any other key, such as set-ups,
    as many of healthy recordings and as many of nodules. Each must leave `LEAST_HEALTHY` healthy
    recordings and `LEAST_NODULES` with a nodule to learn from. A recording whose header names no
    group is left out with its place.
    """
    named = {name: row[key] for name, row in rows.items() if row.get(key)}
    healthy, nodules = (
        [name for name in rows if (size_mm(name) == 0) == kind] for kind in (True, False)
    )
    for kind in [named] if key == "session" else [healthy, nodules]:
        if len({named[name] for name in kind if name in named}) < LEAST_GROUPS:
            return {}
    for kind, least in ((healthy, LEAST_HEALTHY), (nodules, LEAST_NODULES)):
        teach = Counter(named.get(name) for name in kind if not rows[name].get("no_verdict"))
        if any(teach.total() - teach[group] < least for group in named.values()):
            return {}
    # No header holds a line feed, so no group has the name of a place.
    return {name: named.get(name, f"\n{alone[name]}") for name in rows}


def number_of_folds(recordings: int, most: int) -> int:
    """Return into how many folds an archive may be divided, at most `most`.

    Each fold is some work on all recordings. So this work grows with the square of the archive up
    to `most` recordings. Beyond, fewer folds keep it the same, until 50 folds are left.
    """
    return max(most**2 // max(recordings, most), min(most, _FEWEST_FOLDS))


def _together(rows: Rows, place: Mapping[str, str], most: int) -> dict[str, str]:
    """Return the group with which each recording is left out: its place, or several places.

    With more places than `number_of_folds`, neighbouring places whose recordings have the same
    sizes are left out together, as few as possible. Then few templates change in a fold.
    """
    kind_of = {
        each: str(sorted({size_mm(name) or 0.0 for name in names}))
        for each, names in grouped(rows, place).items()
    }
    of_kind, each = grouped(kind_of, kind_of), 1
    most = max(number_of_folds(len(rows), most), len(of_kind))
    while sum(ceil(len(places) / each) for places in of_kind.values()) > most:
        each += 1
    group_of = {
        of_place: f"{kind}:{turn // each}"
        for kind, places in of_kind.items()
        for turn, of_place in enumerate(places)
    }
    return {name: group_of[place[name]] for name in rows}


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
        ``no_verdict`` is the reason for no verdict. ``familiar`` and those after it tell
        whether the recording is of the kind that teaches; they are empty for one that no detector
        judges. ``verdict`` is one of `capsule.detectors.verdicts.VerdictWord`.

    Raises
    ------
    CapsuleError
        The configuration names a detector that does not exist.
    """

    def __init__(self, archive: TrainingArchive) -> None:
        self.names = list(archive.settings["detectors"])
        self._archive = archive
        self._detectors = {name: detector_class(name) for name in self.names}
        # The last fold, and the one that leaves nothing out.
        self._taught = lru_cache(maxsize=2)(self._teach)
        self._distances = [f"{DISTANCE}{size_label(size)}" for size in archive.templates.sizes_mm]
        predicted, *others = verdict_cells(NO_VERDICT, 1.0)
        self.columns = [predicted, *self._distances, *others, *Familiarity(None).cells, "verdict"]

    def rows(self, names: Sequence[str], left_out: Iterable[str]) -> Iterator[Cells]:
        """Yield each detector's verdict on some recordings; those left out teach nothing."""
        reasons = [self._archive.no_verdict.get(name) for name in names]
        recordings = [self._archive.recordings[name] for name in names]
        traits = [each.traits for each, why in zip(recordings, reasons, strict=True) if not why]
        models, familiar = self._taught(frozenset(left_out))
        kinds = iter(familiar.judge_all(traits))
        rate_hz = self._archive.settings["recording"]["rate_hz"]
        for name, recording, reason in zip(names, recordings, reasons, strict=True):
            kind = Familiarity(None) if reason else next(kinds)
            for detector, model in models.items():
                verdict = NO_VERDICT if reason else model.verdict(recording)
                cells = verdict_cells(verdict, rate_hz, reason)
                distances = verdict.distances or [None] * len(self._distances)
                cells |= zip(self._distances, distances, strict=True)
                cells |= {"recording": name, "detector": detector, **kind.cells}
                yield cells | {"verdict": str(row_verdict(cells))}

    def _teach(self, left_out: frozenset[str]) -> tuple[dict[str, Detector], FamiliarKind]:
        """Teach the detectors, and what is familiar, without some recordings."""
        models = {
            name: each.taught(self._archive, left_out) for name, each in self._detectors.items()
        }
        return models, FamiliarKind.taught(self._archive, left_out)

    def stored(self) -> Cells:
        """Return the models that judge other recordings."""
        content: Cells = {"recordings": len(self._archive.sizes_mm)}
        for detector in self._detectors.values():
            content |= detector.taught(self._archive).stored()
        content[FAMILIAR] = FamiliarKind.taught(self._archive).stored()
        return content


def verdict_cells(verdict: Verdict, rate_hz: float, reason: str | None = None) -> Cells:
    """Return the cells of a verdict without its distances, in the order of the tables.

    The time of the location is in seconds. The reason is why no detector judges the recording.
    """
    cells = dict(vars(verdict))
    del cells["distances"]
    cells["location_s"] = cells.pop("location_samples") / rate_hz
    cells["location_mm"] = cells.pop("location_mm")
    cells["no_verdict"] = reason or why_unknown(verdict)
    return cells


def cross_validate(detectors: Detectors, folds: Sequence[Fold]) -> list[Cells]:
    """Return the verdicts on labelled recordings, each from its own training fold.

    The rows are those of `Detectors.rows` with ``size_mm`` and ``scheme``, in the order of the
    detectors and of the folds, which are from `folds_of`. Folds that differ in the scheme alone are
    judged once.
    """
    judged: dict[tuple[str, frozenset[str]], list[Cells]] = {}
    for names, left_out in dict.fromkeys((fold.judged, fold.left_out) for fold in folds):
        rows = iter(detectors.rows(names, left_out))
        for name in names:
            judged[name, left_out] = list(islice(rows, len(detectors.names)))
    of_all = [
        row | {"size_mm": size_mm(name), "scheme": fold.scheme}
        for fold in folds
        for name in fold.judged
        for row in judged[name, fold.left_out]
    ]
    return sorted(of_all, key=lambda row: detectors.names.index(row["detector"]))


def judge_unlabelled(
    detectors: Detectors, names: Sequence[str], rows: Rows, apart: Sequence[str] = ()
) -> list[Cells]:
    """Return the verdicts of `Detectors.rows` on the named unlabelled recordings.

    All labelled recordings teach, except those apart, of held-out sessions, and those of the same
    place. The rows are those of all accepted recordings.
    """
    place = places_of(rows)
    labelled = grouped((name for name in rows if size_mm(name) is not None), place)
    left_out = {name: frozenset(apart).union(labelled.get(place[name], ())) for name in names}
    folds = grouped(names, left_out)
    return [row for without, judged in folds.items() for row in detectors.rows(judged, without)]
