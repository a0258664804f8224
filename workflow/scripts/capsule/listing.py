"""The list of every recording: what was accepted, what was not, and why."""

from collections.abc import Iterator, Mapping

from capsule.naming import Archive, as_cell, folder_of, folder_size_mm, reason_of_copy
from capsule.recording import source_of

# Lines of the headers that have a column of their own.
FROM_HEADER = ["site", "session", "nodule_at_mm"]
COLUMNS = ["recording", "size_mm", "samples", "duration_s", "status", "reason", "sha256", "source"]
COLUMNS += FROM_HEADER


def list_rows(archive: Archive, checks: Mapping[str, Mapping]) -> Iterator[dict]:
    """Give one row a recording, in order; of equal contents only the first is accepted.

    Parameters
    ----------
    archive : Archive
        The files under raw/.
    checks : mapping of str to mapping
        The outcome of each recording's check; one without is left out.

    Yields
    ------
    dict
        The cells of `COLUMNS`.
    """
    first_with: dict[str, str] = {}
    for name in archive.recordings:
        if name not in checks:
            continue
        check = dict(checks[name])
        check |= {key: as_cell(check["header"].get(key, "")) for key in FROM_HEADER}
        check["source"] = as_cell(source_of(check["header"]))
        if check["status"] == "accepted":
            # The readings, not the bytes: other line ends or headers make no other recording.
            original = first_with.setdefault(check["readings_sha256"], name)
            if original != name:
                check |= {"status": "rejected", "reason": reason_of_copy(original, name)}
        yield {column: check[column] for column in COLUMNS}
    for path, reason in archive.refused.items():
        row = dict.fromkeys(COLUMNS) | {"recording": path, "status": "rejected", "reason": reason}
        yield row | {"size_mm": folder_size_mm(folder_of(path))}
