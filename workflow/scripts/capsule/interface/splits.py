"""Provide the folds of the workflow's evaluation as a splitter for scikit-learn."""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from capsule.errors import CapsuleError
from capsule.evaluation.cross_validation import (
    LEAST_GROUPS,
    LEAVE_ONE_OUT,
    RESUBSTITUTION,
    Fold,
    folds_of,
    group_scheme,
)
from capsule.interface.loaded_archive import LoadedArchive
from capsule.kinds import Row


class RecordingSplitter:
    """A splitter of an archive's labelled recordings into teaching and judged recordings.

    `folds` makes a splitter; any ``cv=`` argument of scikit-learn accepts it.

    Parameters
    ----------
    folds : sequence of Fold
        The folds of one scheme.
    rows : mapping of str to mapping
        The rows of results/recordings.csv of the labelled recordings, in their order.
    """

    def __init__(self, folds: Sequence[Fold], rows: Mapping[str, Row]) -> None:
        self.scheme = folds[0].scheme
        usable = np.array([not row["no_verdict"] for row in rows.values()], dtype=bool)
        place = {name: number for number, name in enumerate(rows)}
        self._parts = []
        for fold in folds:
            teaches = usable.copy()
            teaches[[place[name] for name in fold.left_out]] = False
            judged = np.array([place[name] for name in fold.judged], dtype=int)
            self._parts.append((np.flatnonzero(teaches), judged))

    def split(
        self,
        X: object = None,
        y: object = None,
        groups: object = None,
    ) -> Iterator[tuple[np.ndarray, np.ndarray]]:
        """Yield, for each fold, the rows of ``archive.X`` that teach and those that are judged.

        A recording that no detector can judge does not teach. Each recording is judged once, except
        that those of held-out sessions are judged under ``held_out`` alone.
        """
        yield from self._parts

    def get_n_splits(
        self,
        X: object = None,
        y: object = None,
        groups: object = None,
    ) -> int:
        """Return the number of folds."""
        return len(self._parts)


def folds(archive: LoadedArchive, scheme: str = LEAVE_ONE_OUT) -> RecordingSplitter:
    """Return the workflow's folds of an archive.

    Parameters
    ----------
    archive : LoadedArchive
        The archive, whose labelled recordings are split.
    scheme : str
        ``leave_one_out``: all others teach when the recordings of a place are judged: those of a
        site, and near copies; with more places than `evaluation.most_folds`, several are left out
        together. ``leave_one_session_out``, ``leave_one_setup_out``: the other sessions or set-ups
        teach. ``held_out``: the recordings of `evaluation.held_out` are judged by all others.
        ``resubstitution``: all recordings teach and are judged.

    Returns
    -------
    RecordingSplitter
        The splitter; its indices are rows of ``archive.X``.

    Raises
    ------
    CapsuleError
        If there is no such scheme, or the archive does not allow it.
    """
    rows = {name: archive.index([name])[name] for name in archive.labelled}
    rules = archive.settings["evaluation"] | {"schemes": [LEAVE_ONE_OUT, RESUBSTITUTION]}
    of_scheme: dict[str, list[Fold]] = {}
    for fold in folds_of(rows, rules):
        of_scheme.setdefault(fold.scheme, []).append(fold)
    if scheme not in of_scheme:
        grouped = scheme in [group_scheme(key) for key in rules["groups"]]
        why = (
            f"its headers name fewer than {LEAST_GROUPS} of a kind, or one leaves too few to teach"
            if grouped
            else f"it has: {', '.join(of_scheme)}"
        )
        raise CapsuleError(f"folds: this archive has no scheme {scheme!r}; {why}")
    return RecordingSplitter(of_scheme[scheme], rows)
