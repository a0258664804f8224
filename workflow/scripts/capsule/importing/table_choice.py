"""Choose the tables of a file that are runs."""

import difflib
from collections.abc import Sequence
from types import SimpleNamespace

from capsule.errors import CapsuleError
from capsule.importing.question import QuestionError
from capsule.importing.source_table import SourceTable

ALL = "all"
_NAMED_AT_MOST = 12


def choose_tables(
    tables: Sequence[SourceTable], keys: SimpleNamespace, needed: int
) -> list[SourceTable]:
    """Return the tables that are runs: the named table, all tables, or the only one that fits.

    Parameters
    ----------
    tables : sequence of SourceTable
        The tables of a file.
    keys : SimpleNamespace
        The keys of lab.yaml, of which ``sheet`` and ``variable`` are used.
    needed : int
        Least number of columns of numbers of a run.

    Raises
    ------
    CapsuleError
        If the named table does not exist, or several tables fit.
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
        raise QuestionError(
            f"{len(fitting)} of its parts can be the recording: "
            f"{_listed([table.label for table in fitting])}; name one with --{kind}, or use "
            f"--{kind} all if each one is a run"
        )
    return fitting


def _listed(labels: Sequence[str]) -> str:
    shown = ", ".join(repr(label) for label in labels[:_NAMED_AT_MOST])
    more = len(labels) - _NAMED_AT_MOST
    return (shown or "none") + (f" and {more} more" if more > 0 else "")
