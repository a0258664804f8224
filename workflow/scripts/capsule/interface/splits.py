"""The folds of the workflow's evaluation, as a splitter of scikit-learn."""

from collections.abc import Iterator, Mapping

import numpy as np

from capsule.errors import CapsuleError
from capsule.evaluation.folds import (
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
    """Splits the labelled recordings of an archive into those that teach and those judged.

    `folds` makes it; any ``cv=`` of scikit-learn takes it.

    Parameters
    ----------
    scheme : Folds
        Of the labelled recordings.
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
        """Give, fold by fold, the rows of ``archive.X`` that teach and those that are judged.

        A recording that no detector can judge teaches nothing; each recording is judged once.
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
    """Give the workflow's folds of an archive.

    Parameters
    ----------
    archive : LoadedArchive
        Its labelled recordings.
    scheme : str
        ``leave_one_out``: one recording is judged by all others, but for those that are nearly the
        same; ``leave_one_site_out``, ``leave_one_session_out`` or another key of the recordings'
        headers: all recordings of a site are judged by those of the other sites;
        ``resubstitution``: all are judged by all.

    Returns
    -------
    RecordingSplitter
        With ``split`` and ``get_n_splits``; the indices are rows of ``archive.X``.

    Raises
    ------
    CapsuleError
        There is no such scheme, or no two recordings share a site.
    """
    rows = {name: archive.index([name])[name] for name in archive.labelled}
    if scheme in (LEAVE_ONE_OUT, RESUBSTITUTION):
        (one_each,) = scheme_folds([scheme], rows)
        return RecordingSplitter(one_each, rows)
    key = scheme.removeprefix("leave_one_").removesuffix("_out")
    if scheme != group_scheme(key):
        raise CapsuleError(
            f"folds: there is no scheme {scheme!r}; allowed are {LEAVE_ONE_OUT}, {RESUBSTITUTION} "
            f"and such as {group_scheme('site')}"
        )
    headers = {name: {**archive.headers[name], **row} for name, row in rows.items()}
    made = group_folds(key, headers)
    if made is None:
        raise CapsuleError(
            f"folds: {scheme} leaves nothing out: no two recordings share a {key} in their "
            f"headers, or all share one; use {LEAVE_ONE_OUT}"
        )
    return RecordingSplitter(made, rows)
