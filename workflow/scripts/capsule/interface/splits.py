"""Provide the folds of the workflow's evaluation as a splitter for scikit-learn."""

from collections.abc import Collection, Iterator

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
from capsule.interface.loaded_archive import LoadedArchive, require_archive

Part = tuple[np.ndarray, np.ndarray]


class RecordingSplitter:
    """A splitter of ``archive.X`` for the argument ``cv=`` of scikit-learn; `folds` makes one."""

    def __init__(self, parts: list[Part], scheme: str) -> None:
        self._parts, self.scheme = parts, scheme

    def split(self, X: object = None, y: object = None, groups: object = None) -> Iterator[Part]:
        """Yield, for each fold, the rows of ``archive.X`` that teach and those that are judged.

        A recording that no detector can judge does not teach. Each recording is judged once, except
        that those of held-out sessions are judged under ``held_out`` alone.
        """
        yield from self._parts

    def get_n_splits(self, X: object = None, y: object = None, groups: object = None) -> int:
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
    require_archive(archive)
    row = {name: number for number, name in enumerate(archive.labelled)}
    parts = [
        (teaching_rows(archive, fold.left_out), np.array([row[name] for name in fold.judged]))
        for fold in folds_of_scheme(archive, scheme)
    ]
    return RecordingSplitter(parts, scheme)


def teaching_rows(archive: LoadedArchive, left_out: Collection[str]) -> np.ndarray:
    """Return the rows of ``archive.X`` that teach when some recordings are left out."""
    index = archive.index(archive.labelled)
    return np.flatnonzero(
        [not index[name]["no_verdict"] and name not in left_out for name in archive.labelled]
    )


def folds_of_scheme(archive: LoadedArchive, scheme: str) -> list[Fold]:
    """Return the workflow's folds of one scheme; for the errors see `folds`."""
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
    return of_scheme[scheme]
