"""The schemes of the evaluation, and the verdicts of the detectors under each of them.

The unit that is left out is the place: all recordings of a site, and near copies. Recordings of a
held-out session teach nothing under any scheme.
"""

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import ceil

from capsule.detectors.familiar import FAMILIAR, Familiarity, FamiliarTeacher
from capsule.detectors.registry import detector_row
from capsule.detectors.training import Detector, TrainingArchive, detector_class
from capsule.detectors.verdicts import NO_VERDICT, Verdict, why_unknown
from capsule.detectors.wave_traits import UNKNOWN_TRAITS
from capsule.held_out import teaching
from capsule.kinds import Cells, Settings, Spread
from capsule.naming import size_label, size_mm
from capsule.places import places_of

HELD_OUT = "held_out"
LEAVE_ONE_OUT = "leave_one_out"
RESUBSTITUTION = "resubstitution"
# Even the largest archive is divided into so many folds, so that nearly all of it teaches.
_FEWEST_FOLDS = 50
# Fewer sessions, or set-ups of a kind, say nothing about a further one.
LEAST_GROUPS = 3
# Without so many recordings of each kind, no detector learns what it needs.
LEAST_HEALTHY, LEAST_NODULES = 3, 1
# Recordings that one process judges in turn.
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
    "familiar",
    "unfamiliar_because",
)
Rows = Mapping[str, Mapping[str, str]]
# The recordings that are judged, and those that teach nothing.
_Sides = tuple[tuple[str, ...], frozenset[str]]


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
    """Return the scheme whose numbers are the main result: held-out sessions, if there are any.

    Parameters
    ----------
    schemes : iterable of str
        The schemes that were computed.
    """
    schemes = list(schemes)
    return HELD_OUT if HELD_OUT in schemes else choosing_scheme(schemes)


@dataclass(frozen=True)
class Fold:
    """One training fold.

    Attributes
    ----------
    scheme : str
    judged : tuple of str
        The recordings that are judged.
    left_out : frozenset of str
        The recordings that teach nothing, the judged ones among them unless under resubstitution.
    """

    scheme: str
    judged: tuple[str, ...]
    left_out: frozenset[str]


def grouped(names: Iterable[str], group_of: Mapping[str, str]) -> dict[str, list[str]]:
    """Return the recordings of each group; groups and recordings keep the order of the names."""
    members: dict[str, list[str]] = {}
    for name in names:
        members.setdefault(group_of[name], []).append(name)
    return members


def folds_of(rows: Rows, rules: Settings) -> list[Fold]:
    """Return the training folds of all schemes that the archive allows.

    Parameters
    ----------
    rows : mapping of str to mapping
        The rows of the accepted labelled recordings, with ``site``, ``session``, ``setup``,
        ``near_copies`` and ``no_verdict``.
    rules : mapping
        Section ``evaluation`` of the configuration: ``schemes``, ``groups``, ``held_out`` and
        ``most_folds``.

    Returns
    -------
    list of Fold
        In the order of the schemes: held-out sessions; the configured schemes but resubstitution;
        groups; resubstitution.
    """
    taught = teaching(rows, rules["held_out"])
    apart = [name for name in rows if name not in taught]
    place = places_of(rows)
    members = grouped(rows, place)

    def fold(scheme: str, judged: Iterable[str]) -> Fold:
        """Leave out the places of the judged recordings, and all that is held out."""
        judged = tuple(judged)
        own = (other for name in judged for other in members[place[name]])
        return Fold(scheme, judged, frozenset(apart).union(own))

    # A held-out recording at a place that teaches, too, has a fold of its own.
    shared = {place[name] for name in taught}
    apart_with = {name: place[name] if place[name] in shared else "" for name in apart}
    folds = [fold(HELD_OUT, judged) for judged in grouped(apart, apart_with).values()]
    groups = {LEAVE_ONE_OUT: _together(taught, place, rules["most_folds"])}
    for key in rules["groups"]:
        groups[group_scheme(key)] = _header_groups(key, taught, groups[LEAVE_ONE_OUT])
    for scheme, group_of in groups.items():
        if scheme == LEAVE_ONE_OUT and scheme not in rules["schemes"]:
            continue
        folds += [fold(scheme, judged) for judged in grouped(group_of, group_of).values()]
    if RESUBSTITUTION in rules["schemes"] and taught:
        folds.append(Fold(RESUBSTITUTION, tuple(taught), frozenset(apart)))
    return folds


def _header_groups(key: str, rows: Rows, alone: Mapping[str, str]) -> dict[str, str]:
    """Return the group of each recording; empty if leaving groups out says nothing.

    There must be at least `LEAST_GROUPS` sessions; of the groups of any other key, such as set-ups,
    as many of healthy recordings and as many of nodules. Each must leave `LEAST_HEALTHY` healthy
    recordings and `LEAST_NODULES` with a nodule to learn from. A recording whose header names no
    group is left out with its place.
    """
    named = {name: row[key] for name, row in rows.items() if row.get(key)}
    healthy = {name: group for name, group in named.items() if size_mm(name) == 0}
    nodules = {name: group for name, group in named.items() if name not in healthy}
    for kind in [named] if key == "session" else [healthy, nodules]:
        if len(set(kind.values())) < LEAST_GROUPS:
            return {}
    teaching_names = [name for name, row in rows.items() if not row.get("no_verdict")]
    kinds = Counter(size_mm(name) == 0 for name in teaching_names)
    of_group = Counter((named.get(name), size_mm(name) == 0) for name in teaching_names)
    for group in set(named.values()):
        if kinds[True] - of_group[group, True] < LEAST_HEALTHY:
            return {}
        if kinds[False] - of_group[group, False] < LEAST_NODULES:
            return {}
    # No header holds a line feed, so no group has the name of a place.
    return {name: named.get(name, f"\n{alone[name]}") for name in rows}


def number_of_folds(recordings: int, most: int) -> int:
    """Return into how many folds an archive may be divided.

    Each fold is some work on all recordings. So this work grows with the square of the archive up
    to `most` recordings. Beyond, fewer folds keep it the same, until 50 folds are left.

    Parameters
    ----------
    recordings : int
        Number of labelled recordings.
    most : int
        Largest number of folds.
    """
    if recordings <= most:
        return most
    return max(most**2 // recordings, min(most, _FEWEST_FOLDS))


def _together(rows: Rows, place: Mapping[str, str], most: int) -> dict[str, str]:
    """Return the group with which each recording is left out: its place, or several places.

    With more places than `number_of_folds`, neighbouring places whose recordings have the same
    sizes are left out together, as few as possible. Then few templates change in a fold.
    """
    sizes: dict[str, set[float]] = {}
    for name in rows:
        sizes.setdefault(place[name], set()).add(size_mm(name) or 0.0)
    kind_of = {each: str(sorted(of_place)) for each, of_place in sizes.items()}
    count = Counter(kind_of.values())
    most, each = max(number_of_folds(len(rows), most), len(count)), 1
    while sum(ceil(places / each) for places in count.values()) > most:
        each += 1
    seen: Counter[str] = Counter()
    group_of = {}
    for of_place, kind in kind_of.items():
        group_of[of_place] = f"{kind}:{seen[kind] // each}"
        seen[kind] += 1
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
        ``no_verdict`` is the reason for no verdict. ``familiar`` and ``unfamiliar_because`` tell
        whether the recording is of the kind that teaches; they are empty for one that no detector
        judges.

    Raises
    ------
    CapsuleError
        The configuration names a detector that does not exist.
    """

    def __init__(self, archive: TrainingArchive) -> None:
        self.names = list(archive.settings["detectors"])
        self._archive = archive
        self._detectors = {name: detector_class(name)(archive) for name in self.names}
        self._familiar = FamiliarTeacher(archive)
        self._distances = [f"rmse_{size_label(size)}" for size in archive.templates.sizes_mm]
        self.columns = ["predicted_mm", *self._distances, *_COLUMNS]

    def rows(self, names: Sequence[str], left_out: Iterable[str]) -> Iterator[Cells]:
        """Yield each detector's verdict on some recordings; those left out teach nothing."""
        left_out = sorted(left_out)
        models = {name: each.without(left_out) for name, each in self._detectors.items()}
        familiar = self._familiar.without(left_out)
        for name in names:
            recording, reason = self._archive.recording(name), self._archive.no_verdict.get(name)
            traits = self._archive.traits.get(name, UNKNOWN_TRAITS)
            kind = Familiarity(None) if reason else familiar.judge(traits)
            for detector, model in models.items():
                verdict = NO_VERDICT if reason else model.verdict(recording)
                cells = verdict_cells(verdict, self._archive.settings["recording"]["rate_hz"])
                distances = verdict.distances or [None] * len(self._distances)
                cells |= zip(self._distances, distances, strict=True)
                cells["no_verdict"] = reason or why_unknown(verdict)
                yield {"recording": name, "detector": detector, **cells, **kind.cells}

    def learners(self) -> dict[str, Detector]:
        """Return by name the detectors that learn a threshold and can learn it anew quickly."""
        rows = {name: detector_row(name) for name in self.names}
        return {
            name: self._detectors[name]
            for name, row in rows.items()
            if row.fixed_threshold is None and not row.by_templates
        }

    def stored(self, left_out: Sequence[str] = ()) -> Cells:
        """Return the models that judge other recordings; those left out teach nothing."""
        content: Cells = {"recordings": len(self._archive.sizes_mm.keys() - set(left_out))}
        for detector in self._detectors.values():
            content |= detector.without(left_out).stored()
        content[FAMILIAR] = self._familiar.without(left_out).stored()
        return content


def verdict_cells(verdict: Verdict, rate_hz: float) -> Cells:
    """Return the cells of a verdict without its distances; the location is in seconds."""
    cells = dict(vars(verdict))
    del cells["distances"]
    cells["location_s"] = cells.pop("location_samples") / rate_hz
    return cells


def cross_validate(
    detectors: Detectors, folds: Sequence[Fold], spread: Spread = map
) -> list[Cells]:
    """Return the verdicts on labelled recordings, each from its own training fold.

    Parameters
    ----------
    detectors : Detectors
        The detectors, taught by the same recordings.
    folds : sequence of Fold
        From `folds_of`. Folds that differ in the scheme alone are judged once.
    spread : callable
        Calls a function with each part of the work, like `map`. No part needs the results of
        another.

    Returns
    -------
    list of dict
        One row for each detector, recording and scheme, in the order of the detectors, of the folds
        and of the schemes: the rows of `Detectors.rows` with ``size_mm`` and ``scheme``.
    """
    schemes: dict[_Sides, list[str]] = {}
    for fold in folds:
        for start in range(0, len(fold.judged), _TOGETHER):
            judged = fold.judged[start : start + _TOGETHER]
            schemes.setdefault((judged, fold.left_out), []).append(fold.scheme)

    def judge(part: Sequence[_Sides]) -> list[Cells]:
        return [
            row | {"size_mm": size_mm(row["recording"]), "scheme": scheme}
            for judged, left_out in part
            for row in detectors.rows(judged, left_out)
            for scheme in schemes[judged, left_out]
        ]

    rows = [row for rows in spread(judge, _parts(list(schemes))) for row in rows]
    orders = {
        "detector": detectors.names,
        "recording": dict.fromkeys(name for fold in folds for name in fold.judged),
        "scheme": dict.fromkeys(fold.scheme for fold in folds),
    }
    turns = {
        column: {cell: turn for turn, cell in enumerate(cells)} for column, cells in orders.items()
    }
    return sorted(rows, key=lambda row: [turn[row[column]] for column, turn in turns.items()])


def _parts(folds: Sequence[_Sides]) -> list[list[_Sides]]:
    """Divide folds into parts of about as many judged recordings; a fold stays whole."""
    parts: list[list[_Sides]] = []
    together = _TOGETHER
    for fold in folds:
        if together + len(fold[0]) > _TOGETHER:
            parts.append([])
            together = 0
        parts[-1].append(fold)
        together += len(fold[0])
    return parts


def judge_unlabelled(
    detectors: Detectors, names: Sequence[str], rows: Rows, apart: Sequence[str] = ()
) -> list[Cells]:
    """Return the verdicts on unlabelled recordings.

    All labelled recordings teach, except those of held-out sessions and those of the same place.

    Parameters
    ----------
    detectors : Detectors
        The detectors, taught by the labelled recordings.
    names : sequence of str
        The unlabelled recordings.
    rows : mapping of str to mapping
        The rows of all accepted recordings.
    apart : sequence of str
        The labelled recordings of held-out sessions.

    Returns
    -------
    list of dict
        The rows of `Detectors.rows`.
    """
    return [
        row
        for left_out, judged in unlabelled_folds(names, rows, apart)
        for row in detectors.rows(judged, left_out)
    ]


def unlabelled_folds(
    names: Sequence[str], rows: Rows, apart: Sequence[str] = ()
) -> list[tuple[frozenset[str], list[str]]]:
    """Return the labelled recordings that do not teach, and the recordings judged without them.

    For the parameters see `judge_unlabelled`.
    """
    place = places_of(rows)
    labelled = grouped((name for name in rows if size_mm(name) is not None), place)
    judged: dict[frozenset[str], list[str]] = {}
    for name in names:
        left_out = frozenset(apart).union(labelled.get(place[name], ()))
        judged.setdefault(left_out, []).append(name)
    return list(judged.items())
