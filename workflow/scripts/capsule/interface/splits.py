"""Provide the folds of the workflow's evaluation as a splitter for scikit-learn."""

from collections.abc import Iterator, Mapping

import numpy as np

from capsule.errors import CapsuleError
from capsule.evaluation.folds import (
    LEAST_HEALTHY,
    LEAST_NODULES,
    LEAVE_ONE_OUT,
    RESUBSTITUTION,
    Folds,
    group_folds,
    group_scheme,
    scheme_folds,
)
from capsule.interface.loaded_archive import LoadedArchive
from capsule.kinds import Row


class RecordingSplitter:
    """A splitter of an archive's labelled recordings into teaching and judged recordings.

    `folds` makes a splitter; any ``cv=`` argument of scikit-learn accepts it.

    Parameters
    ----------
    scheme : Folds
        The folds of the labelled recordings.
    rows : mapping of str to mapping
        Their rows of results/recordings.csv, in the order of the recordings.
    """

    def __init__(self, scheme: Folds, rows: Mapping[str, Row]) -> None:
        self.scheme = scheme.scheme
        self._judged = np.array([not row["no_verdict"] for row in rows.values()], dtype=bool)
        self._parts = list(scheme.parts())

    def split(
        self,
        X: object = None,
        y: object = None,
        groups: object = None,
    ) -> Iterator[tuple[np.ndarray, np.ndarray]]:
        """Yield, for each fold, the rows of ``archive.X`` that teach and those that are judged.

        A recording that no detector can judge does not teach. Each recording is judged once.
        """
        for judged, left_out in self._parts:
            taught = self._judged.copy()
            taught[left_out] = False
            yield np.flatnonzero(taught), judged

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
        ``leave_one_out``: all others teach when one recording is judged, except those that are
        nearly the same; with more recordings than `evaluation.most_folds`, several of one size are
        left out together. ``leave_one_site_out``, ``leave_one_session_out`` or another key of the
        headers: the other sites teach when all recordings of a site are judged.
        ``resubstitution``: all recordings teach and are judged.

    Returns
    -------
    RecordingSplitter
        The splitter; its indices are rows of ``archive.X``.

    Raises
    ------
    CapsuleError
        If there is no such scheme, if no two recordings share a site, or if too few are left to
        teach.
    """
    rows = {name: archive.index([name])[name] for name in archive.labelled}
    most = archive.settings["evaluation"]["most_folds"]
    if scheme in (LEAVE_ONE_OUT, RESUBSTITUTION):
        (made,) = scheme_folds([scheme], rows, most)
        return RecordingSplitter(made, rows)
    key = scheme.removeprefix("leave_one_").removesuffix("_out")
    if scheme != group_scheme(key):
        raise CapsuleError(
            f"folds: there is no scheme {scheme!r}; allowed are {LEAVE_ONE_OUT}, {RESUBSTITUTION} "
            f"and leave_one_KEY_out, such as {group_scheme('site')}"
        )
    headers = {name: {**archive.headers[name], **row} for name, row in rows.items()}
    grouped = group_folds(key, headers, most)
    if grouped is None:
        raise CapsuleError(
            f"folds: {scheme} leaves nothing out: no two recordings share a {key} in their "
            f"headers, or without it fewer than {LEAST_HEALTHY} healthy recordings and "
            f"{LEAST_NODULES} with a nodule are left; use {LEAVE_ONE_OUT}"
        )
    return RecordingSplitter(grouped, rows)
