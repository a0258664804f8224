"""The list of all recordings: which are accepted, which are rejected and why, and near-copies.

A near-copy is one run with a changed sample, rows cut off or another unit. If one near-copy teaches
a detector, the verdict on the other one is not independent. Comparing all pairs of thousands of
recordings reading by reading takes too long. Short fingerprints therefore choose the pairs first.
"""

from collections.abc import Callable, Mapping, Sequence
from statistics import median

import numpy as np

from capsule.arrays import FloatArray, IntArray
from capsule.errors import CapsuleError
from capsule.kinds import Cells, Row
from capsule.recordings.names import (
    Archive,
    as_cell,
    folder_of,
    folder_size_mm,
    reason_of_copy,
    size_mm,
    sort_key,
)
from capsule.recordings.recording import rate_of, source_of

# Header lines that have a column of their own.
FROM_HEADER = ["site", "session", "setup", "unit", "rate_hz", "nodule_at_mm"]
COLUMNS = ["recording", "size_mm", "samples", "duration_s", "status", "reason", "no_verdict"]
COLUMNS += ["sha256", "readings_sha256", "source", *FROM_HEADER]
NEAR_COPIES = "near_copies"
# Two recordings of one run share at least this part of the marks of the shorter list.
_SHARED_MARKS = 0.25
# Two recordings hold the same run if the median correlation over this many sections is at least
# _SAME. Two runs over the same place stay far below it, because their noise differs.
_SECTIONS = 8
_SAME = 0.99
# Smallest part of the shorter recording that must overlap the other.
_LEAST_OVERLAP = 0.5
# In robust spreads. Clipping keeps one wild reading from hiding the rest.
_CLIPPED_AT = 4.0


def full_list(
    archive: Archive, checks: Mapping[str, Row], load: Callable[[str], FloatArray]
) -> list[Cells]:
    """Return one row a recording, in order; of recordings with equal content, at most one counts.

    Parameters
    ----------
    archive : Archive
        The files under raw/.
    checks : mapping of str to mapping
        The outcome of each recording's check; a recording without one is left out.
    load : callable
        ``load(name)`` returns the readings of an accepted recording, (S, K). Few are loaded.

    Returns
    -------
    list of dict
        The cells of `COLUMNS` and of `NEAR_COPIES`.
    """
    rows: list[Cells] = []
    copies = reasons_of_copies(checks)
    for name in archive.recordings:
        if name not in checks:
            continue
        check = dict(checks[name])
        check |= {key: as_cell(check["header"].get(key, "")) for key in FROM_HEADER}
        check["source"] = as_cell(source_of(check["header"]))
        check["rate_hz"] = as_cell(rate_of(check["header"]))
        if name in copies:
            check |= {"status": "rejected", "reason": copies[name]}
        rows.append({column: check[column] for column in COLUMNS})
    accepted = [row["recording"] for row in rows if row["status"] == "accepted"]
    # Sorted by content: names change neither which pairs are compared nor in which order.
    accepted.sort(key=lambda name: checks[name]["readings_sha256"])
    alike = near_copies({name: checks[name]["marks"] for name in accepted}, load)
    for path, reason in archive.refused.items():
        row = dict.fromkeys(COLUMNS) | {"recording": path, "status": "rejected", "reason": reason}
        rows.append(row | {"size_mm": folder_size_mm(folder_of(path))})
    for row in rows:
        row[NEAR_COPIES] = " ".join(sorted(alike.get(row["recording"], []), key=sort_key))
    return rows


def refuse_rejected(rows: Sequence[Row]) -> None:
    """Raise an error if a recording is rejected; used if on_rejected is fail.

    Raises
    ------
    CapsuleError
        Lists each rejected recording and the reason.
    """
    rejected = [row for row in rows if row["status"] != "accepted"]
    if rejected:
        lines = "".join(f"\n  {row['recording']}: {row['reason']}" for row in rejected)
        raise CapsuleError(
            f"on_rejected is fail, and these recordings are rejected:{lines}\n"
            "repair or remove them, or set on_rejected: report in config/config.yaml"
        )


def reasons_of_copies(checks: Mapping[str, Row]) -> dict[str, str]:
    """Return the reason for each recording that repeats the readings of another one.

    If the copies have different sizes, no labelled one counts, because nobody knows which label is
    right. Otherwise one copy counts: a labelled one if there is one, then the one with the
    shortest name, then the first. Copies often have names such as ``r01-copy`` or ``old-r01``, so
    this is usually the original. No number in the results depends on the choice.

    Parameters
    ----------
    checks : mapping of str to mapping
        The outcome of each recording's check.

    Returns
    -------
    dict of str to str
        The reason for each recording that is no longer accepted.
    """
    groups: dict[str, list[str]] = {}
    for name, check in checks.items():
        if check["status"] == "accepted":
            # Readings are compared, not bytes: line ends and headers may differ between copies.
            groups.setdefault(check["readings_sha256"], []).append(name)
    reasons: dict[str, str] = {}
    for names in groups.values():
        reasons |= _reasons_within(sorted(names, key=sort_key))
    return reasons


def _reasons_within(names: Sequence[str]) -> dict[str, str]:
    reasons, remaining = {}, list(names)
    if len({size_mm(name) for name in names} - {None}) > 1:
        labelled = [name for name in names if size_mm(name) is not None]
        for name in labelled:
            other = next(each for each in labelled if size_mm(each) != size_mm(name))
            reasons[name] = reason_of_copy(other, name)
        remaining = [name for name in names if name not in reasons]
    if remaining:
        kept = min(remaining, key=lambda name: (size_mm(name) is None, len(name)))
        reasons |= {name: reason_of_copy(kept, name) for name in remaining if name != kept}
    return reasons


def near_copies(
    marks: Mapping[str, Sequence[int] | IntArray], load: Callable[[str], FloatArray]
) -> dict[str, list[str]]:
    """Find recordings that hold the same readings over most of the run.

    Parameters
    ----------
    marks : mapping of str to sequence of int
        The recordings, with the `capsule.recordings.acceptance.fingerprint` of each.
    load : callable
        ``load(name)`` returns the readings of one, (S, K), NaN where a sample is missing.

    Returns
    -------
    dict of str to list of str
        For each recording that has any: its near-copies, and theirs, in the order of `marks`.
    """
    names = list(marks)
    # Recordings of one group share one list of its members.
    members = [[place] for place in range(len(names))]
    for one, other in _candidates([np.array(each, dtype=np.uint64) for each in marks.values()]):
        smaller, larger = sorted((members[one], members[other]), key=len)
        if smaller is not larger and nearly_equal(load(names[one]), load(names[other])):
            larger += smaller
            for place in smaller:
                members[place] = larger
    return {
        name: [names[other] for other in sorted(members[place]) if other != place]
        for place, name in enumerate(names)
        if len(members[place]) > 1
    }


def _candidates(fingerprints: Sequence[IntArray]) -> list[tuple[int, int]]:
    """Return the pairs that share enough marks; among many with one mark, only neighbours."""
    sizes = np.array([each.size for each in fingerprints], dtype=np.int64)
    if not sizes.sum():
        return []
    owner = np.repeat(np.arange(sizes.size), sizes)
    marks = np.concatenate(fingerprints)
    order = np.argsort(marks, kind="stable")
    marks, owner = marks[order], owner[order]
    same = marks[1:] == marks[:-1]
    pairs, shared = np.unique(owner[:-1][same] * sizes.size + owner[1:][same], return_counts=True)
    one, other = np.divmod(pairs, sizes.size)
    enough = shared >= np.maximum(_SHARED_MARKS * np.minimum(sizes[one], sizes[other]), 1.0)
    return list(zip(one[enough].tolist(), other[enough].tolist(), strict=True))


def nearly_equal(one: FloatArray, other: FloatArray) -> bool:
    """Return whether two recordings hold the same readings over most of the shorter one.

    Parameters
    ----------
    one, other : (S, K) and (S, M) array
        Readings; NaN where a sample is missing. Order of the sensors, unit and start may differ.
    """
    first, second = _standardized(one), _standardized(other)
    return any(_equal_at(shift, first, second) for shift in _shifts(first, second))


def _equal_at(shift: int, one: FloatArray, other: FloatArray) -> bool:
    least = _LEAST_OVERLAP * min(one.shape[1], other.shape[1])
    one, other = one[:, max(shift, 0) :], other[:, max(-shift, 0) :]
    overlap = min(one.shape[1], other.shape[1])
    # Two different runs already differ at the first sensor, so this rarely compares the others.
    return overlap >= least and all(
        max(_usual_correlation(row[:overlap], each[:overlap]) for each in other) >= _SAME
        for row in one
    )


def _standardized(values: FloatArray) -> FloatArray:
    centred = values - np.nanmedian(values, axis=1, keepdims=True)
    deviation = np.abs(centred)
    spread = np.nanmedian(deviation, axis=1, keepdims=True)
    # If most readings are equal, that spread is 0, and the largest deviation replaces it.
    spread = np.where(spread > 0, spread, np.fmax.reduce(deviation, axis=1, keepdims=True))
    clipped = np.clip(centred / np.where(spread > 0, spread, 1.0), -_CLIPPED_AT, _CLIPPED_AT)
    return np.where(np.isnan(values), np.nan, clipped)


def _shifts(one: FloatArray, other: FloatArray) -> set[int]:
    """Return by how many samples readings may come later in the first than in the second.

    Each sensor of the second, whose order may differ, gives the lag that fits the first sensor
    best. The spectra of the changes are whitened (phase correlation; Knapp and Carter 1976):
    without it, the waves of a stronger sensor or another period fit better than the same noise.
    """
    length = one.shape[1] + other.shape[1]
    spectra, others = (
        np.fft.rfft(np.nan_to_num(np.diff(values)), length) for values in (one[:1], other)
    )
    products = spectra * np.conj(others)
    products /= np.maximum(np.abs(products), np.finfo(float).tiny)
    best = np.abs(np.fft.irfft(products, length)).argmax(axis=1)
    return set(np.where(best < one.shape[1], best, best - length).tolist())


def _usual_correlation(one: FloatArray, other: FloatArray) -> float:
    """Return the median over sections of the correlation, without its sign."""
    known = ~(np.isnan(one) | np.isnan(other))
    sections = zip(
        np.array_split(one[known], _SECTIONS), np.array_split(other[known], _SECTIONS), strict=True
    )
    known_in_both = [(a, b) for a, b in sections if a.size and np.ptp(a) > 0 and np.ptp(b) > 0]
    return median(_correlation(a, b) for a, b in known_in_both) if known_in_both else 0.0


def _correlation(one: FloatArray, other: FloatArray) -> float:
    """Return the correlation without its sign."""
    one, other = one - one.mean(), other - other.mean()
    return float(abs(one @ other) / np.sqrt((one @ one) * (other @ other)))
