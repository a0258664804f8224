"""Which table of a file that holds several."""

import difflib
from collections.abc import Sequence
from types import SimpleNamespace

from capsule.errors import CapsuleError
from capsule.importing.source_table import SourceTable

ALL = "all"
_NAMED_AT_MOST = 12


def choose_tables(
    tables: Sequence[SourceTable], keys: SimpleNamespace, needed: int
) -> list[SourceTable]:
    """Choose the tables that are runs: by name, all, or the only one that can be.

    Parameters
    ----------
    tables : sequence of SourceTable
        Those of a file.
    keys : SimpleNamespace
        What lab.yaml says: ``sheet``, ``variable``.
    needed : int
        Number of columns of numbers that a run must have.

    Raises
    ------
    CapsuleError
        The named one is not there, or several can be.
    """
    fitting = [
        table for table in tables if sum(column.holds_numbers for column in table.columns) >= needed
    ]
    kind = tables[0].kind if tables else ""
    for key, name in (("sheet", keys.sheet), ("variable", keys.variable)):
        if name and key != kind:
            raise CapsuleError(
                f"{key}: {name!r} is given, but the file holds "
                f"{f'{kind}s' if kind else 'one table'}; leave it out"
            )
    if not kind:
        return list(tables)
    labels = [table.label for table in tables]
    wanted = keys.sheet if kind == "sheet" else keys.variable
    if wanted and wanted != ALL:
        matching = [table for table in tables if table.label == wanted]
        if matching:
            return matching
        near = difflib.get_close_matches(wanted, labels, n=1)
        hint = f"did you mean {near[0]!r}?" if near else f"the file holds {_listed(labels)}"
        raise CapsuleError(f"{kind}: there is no {wanted!r}; {hint}")
    if not fitting:
        raise CapsuleError(
            f"no {kind} holds {needed} columns of numbers; the file holds {_listed(labels)}"
        )
    if len(fitting) > 1 and wanted != ALL:
        raise CapsuleError(
            f"{len(fitting)} of its parts can be the recording: "
            f"{_listed([table.label for table in fitting])}; name one by --{kind}, or give "
            f"--{kind} all if each is a run"
        )
    return fitting


def _listed(labels: Sequence[str]) -> str:
    shown = ", ".join(repr(label) for label in labels[:_NAMED_AT_MOST])
    more = len(labels) - _NAMED_AT_MOST
    return (shown or "none") + (f" and {more} more" if more > 0 else "")
