"""Which recordings teach the detector that judges a recording: the schemes of the evaluation."""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from capsule.arrays import BoolArray, IntArray

RESUBSTITUTION = "resubstitution"
LEAVE_ONE_OUT = "leave_one_out"


def main_scheme(schemes: Sequence[str]) -> str:
    """Choose the scheme whose numbers are the result: leave-one-out, if it was computed."""
    return LEAVE_ONE_OUT if LEAVE_ONE_OUT in schemes else schemes[0]


def group_scheme(key: str) -> str:
    """Name the scheme that leaves out all recordings of a site (or session) at a time."""
    return f"leave_one_{key}_out"


def header_groups(
    key: str, names: Sequence[str], headers: Mapping[str, Mapping[str, str]]
) -> list[str] | None:
    """Group recordings by a line of their headers, such as ``site`` or ``session``.

    Parameters
    ----------
    key : str
        The header line.
    names : sequence of R str
        The recordings.
    headers : mapping of str to mapping
        The header lines of each recording; one without that line is a group by itself.

    Returns
    -------
    list of R str, or None
        None where leaving groups out says nothing of its own: all recordings are of one group,
        so that none is left to learn from, or each is a group by itself, as in leave-one-out.
    """
    # A mark that no header holds keeps unnamed recordings apart from groups of the same name.
    groups = [headers[name].get(key) or f"\n{name}" for name in names]
    return groups if 1 < len(set(groups)) < len(groups) else None


class Folds:
    """The training fold of every recording.

    Parameters
    ----------
    scheme : str
        `RESUBSTITUTION`: every recording teaches; any other name: a recording's own group does
        not.
    groups : sequence of R str
        The group of each recording; the recordings' names leave one out at a time.
    alike : mapping of int to sequence of int, optional
        Recordings that are nearly the same: where one is judged, the others teach nothing either.
    """

    def __init__(
        self, scheme: str, groups: Sequence[str], alike: Mapping[int, Sequence[int]] | None = None
    ) -> None:
        self.scheme = scheme
        self._label = np.unique(np.array(groups, dtype=object), return_inverse=True)[1]
        self._alike = alike or {}

    def training(self, recording: int) -> BoolArray:
        """Tell which recordings teach the detector that judges this one, (R,) of bool."""
        if self.scheme == RESUBSTITUTION:
            return np.ones(self._label.size, dtype=bool)
        taught = np.ones(self._label.size, dtype=bool)
        taught[self._left_out(np.flatnonzero(self._label == self._label[recording]))] = False
        return taught

    def parts(self) -> Iterator[tuple[IntArray, IntArray]]:
        """Give the recordings that one training fold judges, and those that it leaves out."""
        everybody = np.arange(self._label.size)
        if self.scheme == RESUBSTITUTION:
            yield everybody, everybody[:0]
        elif self._label.size:
            ends = np.cumsum(np.bincount(self._label))[:-1]
            for group in np.split(np.argsort(self._label, kind="stable"), ends):
                yield group, self._left_out(group)

    def _left_out(self, group: IntArray) -> IntArray:
        """Give a group with all that are nearly the same as one of it, ascending."""
        others = [other for place in group.tolist() for other in self._alike.get(place, [])]
        return np.union1d(group, np.array(others, dtype=group.dtype)) if others else group


def scheme_folds(schemes: Sequence[str], headers: Mapping[str, Mapping[str, str]]) -> list[Folds]:
    """Give the folds of recordings that are judged one at a time, under each scheme."""
    return [Folds(name, list(headers), nearly_the_same(headers)) for name in schemes]


def group_folds(key: str, headers: Mapping[str, Mapping[str, str]]) -> Folds | None:
    """Give the folds that leave out whole sites or sessions; None as in `header_groups`."""
    groups = header_groups(key, list(headers), headers)
    return None if groups is None else Folds(group_scheme(key), groups, nearly_the_same(headers))


def nearly_the_same(rows: Mapping[str, Mapping[str, str]]) -> dict[int, list[int]]:
    """Give the places of the near-copies of each recording that has any.

    Parameters
    ----------
    rows : mapping of str to mapping
        The recordings, and under ``near_copies`` the names of those that are nearly the same.
    """
    place = {name: index for index, name in enumerate(rows)}
    alike = {
        place[name]: [place[other] for other in row["near_copies"].split() if other in place]
        for name, row in rows.items()
    }
    return {index: others for index, others in alike.items() if others}
