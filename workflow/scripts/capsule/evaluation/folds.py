"""The schemes of the evaluation: which recordings teach the detector that judges a recording."""

from collections import Counter
from collections.abc import Hashable, Iterator, Mapping, Sequence
from math import ceil

import numpy as np

from capsule.arrays import BoolArray, IntArray
from capsule.naming import size_mm

RESUBSTITUTION = "resubstitution"
LEAVE_ONE_OUT = "leave_one_out"
# Even the largest archive is divided into so many folds, so that nearly all of it teaches.
_FEWEST = 100
# Without so many recordings of each kind, no detector learns a threshold.
LEAST_HEALTHY, LEAST_NODULES = 3, 1


def main_scheme(schemes: Sequence[str]) -> str:
    """Return the scheme whose numbers are the main result: leave-one-out, if it was computed."""
    return LEAVE_ONE_OUT if LEAVE_ONE_OUT in schemes else schemes[0]


def group_scheme(key: str) -> str:
    """Return the name of the scheme that leaves out whole groups, such as sites or sessions."""
    return f"leave_one_{key}_out"


def header_groups(
    key: str, names: Sequence[str], headers: Mapping[str, Mapping[str, str]]
) -> list[str] | None:
    """Return the group of each recording from a line of its header, such as ``site``.

    Parameters
    ----------
    key : str
        The header line.
    names : sequence of R str
        The recordings.
    headers : mapping of str to mapping
        The header lines of each recording; a recording without that line is its own group.

    Returns
    -------
    list of R str, or None
        None if leaving groups out is of no use: if no group of several recordings leaves
        `LEAST_HEALTHY` healthy recordings and `LEAST_NODULES` with a nodule to learn from. A group
        of one recording is left out in leave-one-out, too.
    """
    # No header holds a line feed, so a recording without a group gets a name that no group has.
    groups = [headers[name].get(key) or f"\n{name}" for name in names]
    teaching = [place for place, name in enumerate(names) if not headers[name].get("no_verdict")]
    healthy = Counter(groups[place] for place in teaching if size_mm(names[place]) == 0)
    nodules = Counter(groups[place] for place in teaching) - healthy
    of_use = any(
        recordings > 1
        and healthy.total() - healthy[group] >= LEAST_HEALTHY
        and nodules.total() - nodules[group] >= LEAST_NODULES
        for group, recordings in Counter(groups).items()
    )
    return groups if of_use else None


class Folds:
    """The training fold of every recording.

    Parameters
    ----------
    scheme : str
        `RESUBSTITUTION`: every recording teaches. Any other name: the group of the judged
        recording does not teach.
    groups : sequence of R str
        The group of each recording; with names that differ, one is left out at a time.
    alike : mapping of int to sequence of int, optional
        Near-copies of each recording. If one is judged, its near-copies do not teach either.
    """

    def __init__(
        self, scheme: str, groups: Sequence[str], alike: Mapping[int, Sequence[int]] | None = None
    ) -> None:
        self.scheme = scheme
        # Numbered in the order of the recordings. Detectors compute neighbouring folds together.
        number = {group: place for place, group in enumerate(dict.fromkeys(groups))}
        self._label = np.array([number[group] for group in groups], dtype=int)
        self._alike = alike or {}

    def training(self, recording: int) -> BoolArray:
        """Return which recordings teach the detector that judges this one, (R,) of bool."""
        if self.scheme == RESUBSTITUTION:
            return np.ones(self._label.size, dtype=bool)
        taught = np.ones(self._label.size, dtype=bool)
        taught[self._left_out(np.flatnonzero(self._label == self._label[recording]))] = False
        return taught

    def parts(self) -> Iterator[tuple[IntArray, IntArray]]:
        """Yield for each training fold the recordings that it judges, and those left out."""
        everybody = np.arange(self._label.size)
        if self.scheme == RESUBSTITUTION:
            yield everybody, everybody[:0]
        elif self._label.size:
            ends = np.cumsum(np.bincount(self._label))[:-1]
            for group in np.split(np.argsort(self._label, kind="stable"), ends):
                yield group, self._left_out(group)

    def _left_out(self, group: IntArray) -> IntArray:
        """Return a group together with all near-copies of its recordings, ascending."""
        others = [other for place in group.tolist() for other in self._alike.get(place, [])]
        return np.union1d(group, np.array(others, dtype=group.dtype)) if others else group


def number_of_folds(recordings: int, most: int) -> int:
    """Return into how many folds an archive may be divided.

    Each fold is some work on all recordings. So this work grows with the square of the archive up
    to `most` recordings. Beyond, fewer folds keep it the same, until 100 folds are left.

    Parameters
    ----------
    recordings : int
        Number of labelled recordings.
    most : int
        Largest number of folds.
    """
    if recordings <= most:
        return most
    return max(most**2 // recordings, min(most, _FEWEST))


def left_out_together(kinds: Sequence[Hashable], most: int) -> list[str]:
    """Divide recordings into groups that are left out together, as few recordings as possible each.

    Up to `most` recordings, each is a group of its own. All recordings of a group are of one kind.

    Parameters
    ----------
    kinds : sequence of R hashable
        The kind of each recording, which is its size: if one size is left out, only one template
        is made anew. Of one kind, neighbours come into one group.
    most : int
        Largest number of groups. There are never fewer groups than kinds.

    Returns
    -------
    list of R str
        The group of each recording.
    """
    count = Counter(kinds)
    each = 1
    while sum(ceil(n / each) for n in count.values()) > max(most, len(count)):
        each += 1
    seen: Counter[Hashable] = Counter()
    groups = []
    for kind in kinds:
        groups.append(f"{kind}:{seen[kind] // each}")
        seen[kind] += 1
    return groups


def left_out_alone(sizes_mm: Sequence[float | None], most: int) -> list[str]:
    """Return the group of each recording in leave-one-out, by its size.

    At most `number_of_folds`, or one for each size.
    """
    return left_out_together(sizes_mm, number_of_folds(len(sizes_mm), most))


def scheme_folds(
    schemes: Sequence[str], headers: Mapping[str, Mapping[str, str]], most: int
) -> list[Folds]:
    """Return the folds of each scheme, with the groups of `left_out_alone`."""
    groups = left_out_alone([size_mm(name) for name in headers], most)
    return [Folds(name, groups, nearly_the_same(headers)) for name in schemes]


def group_folds(key: str, headers: Mapping[str, Mapping[str, str]], most: int) -> Folds | None:
    """Return the folds that leave out whole sites or sessions; None as in `header_groups`.

    With more groups than `number_of_folds`, several whose recordings have the same sizes are left
    out together. A recording that shares nothing is then left out with the same others as in
    leave-one-out, so that both schemes share the fold.
    """
    groups = header_groups(key, list(headers), headers)
    if groups is None:
        return None
    recordings, folds = Counter(groups), number_of_folds(len(headers), most)
    if len(recordings) <= folds:
        return Folds(group_scheme(key), groups, nearly_the_same(headers))
    sizes_mm: dict[str, set[float | None]] = {}
    for group, name in zip(groups, headers, strict=True):
        if recordings[group] > 1:
            sizes_mm.setdefault(group, set()).add(size_mm(name))
    kinds = [str(sorted(each, key=str)) for each in sizes_mm.values()]
    fold_of = dict(zip(sizes_mm, left_out_together(kinds, folds), strict=True))
    alone = left_out_alone([size_mm(name) for name in headers], most)
    labels = [fold_of.get(group, label) for group, label in zip(groups, alone, strict=True)]
    return Folds(group_scheme(key), labels, nearly_the_same(headers))


def nearly_the_same(rows: Mapping[str, Mapping[str, str]]) -> dict[int, list[int]]:
    """Return the places of the near-copies of each recording that has any.

    Parameters
    ----------
    rows : mapping of str to mapping
        The recordings, with the names of their near-copies under ``near_copies``.
    """
    place = {name: index for index, name in enumerate(rows)}
    alike = {
        place[name]: [place[other] for other in row["near_copies"].split() if other in place]
        for name, row in rows.items()
    }
    return {index: others for index, others in alike.items() if others}
