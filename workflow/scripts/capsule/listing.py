"""The list of all recordings: which are accepted, which are rejected, and why."""

from collections.abc import Callable, Iterator, Mapping, Sequence

from capsule.arrays import FloatArray
from capsule.errors import CapsuleError
from capsule.kinds import Cells, Row
from capsule.names import (
    Archive,
    as_cell,
    folder_of,
    folder_size_mm,
    reason_of_copy,
    size_mm,
    sort_key,
)
from capsule.near_copies import near_copies
from capsule.recording import rate_of, source_of

# Header lines that have a column of their own.
FROM_HEADER = ["site", "session", "setup", "unit", "rate_hz", "nodule_at_mm"]
COLUMNS = ["recording", "size_mm", "samples", "duration_s", "status", "reason", "no_verdict"]
COLUMNS += ["sha256", "readings_sha256", "source", *FROM_HEADER]
NEAR_COPIES = "near_copies"


def full_list(
    archive: Archive, checks: Mapping[str, Row], load: Callable[[str], FloatArray]
) -> list[Cells]:
    """Return the rows of `list_rows`, each with the near-copies of its recording.

    Parameters
    ----------
    archive, checks
        As in `list_rows`.
    load : callable
        ``load(name)`` returns the readings of an accepted recording, (S, K). Few are loaded.

    Returns
    -------
    list of dict
        The cells of `COLUMNS` and of `NEAR_COPIES`.
    """
    rows = list(list_rows(archive, checks))
    accepted = [row["recording"] for row in rows if row["status"] == "accepted"]
    # Sorted by content: names change neither which pairs are compared nor in which order.
    accepted.sort(key=lambda name: checks[name]["readings_sha256"])
    alike = near_copies({name: checks[name]["marks"] for name in accepted}, load)
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


def list_rows(archive: Archive, checks: Mapping[str, Row]) -> Iterator[Cells]:
    """Yield one row a recording, in order; of recordings with equal content, at most one counts.

    Parameters
    ----------
    archive : Archive
        The files under raw/.
    checks : mapping of str to mapping
        The outcome of each recording's check; a recording without one is left out.

    Yields
    ------
    dict
        The cells of `COLUMNS`.
    """
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
        yield {column: check[column] for column in COLUMNS}
    for path, reason in archive.refused.items():
        row = dict.fromkeys(COLUMNS) | {"recording": path, "status": "rejected", "reason": reason}
        yield row | {"size_mm": folder_size_mm(folder_of(path))}


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
