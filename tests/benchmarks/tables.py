"""What benchmarks share: the library and the tests' helpers, tables, and documents that show them.

A benchmark imports this module first, so that it finds the library.
"""

import math
import re
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "workflow" / "scripts"), str(ROOT / "tests")]


def table(rows: Sequence[Mapping]) -> str:
    """Return rows as a Markdown table; shares in per cent."""
    columns = list(dict.fromkeys(key for row in rows for key in row))
    lines = ["| " + " | ".join(columns) + " |", "|" + "---|" * len(columns)]
    lines += ["| " + " | ".join(_cell(key, row.get(key)) for key in columns) + " |" for row in rows]
    return "\n".join(lines) + "\n"


def _cell(column: str, value: float | str | None) -> str:
    if value is None or isinstance(value, str):
        return value or ""
    if math.isnan(value):
        return ""
    plain = "mm)" in column or "seconds" in column
    return f"{value:.3f}" if plain else f"{100 * value:.1f} %"


def filled_page(page: str, blocks: Mapping[str, str], program: str) -> str:
    """Return a document with each passage between its marks written anew.

    The marks of a passage are ``<!-- PROGRAM: NAME -->`` and ``<!-- end: NAME -->``.
    """
    for name, block in blocks.items():
        begin, end = f"<!-- {program}: {name} -->", f"<!-- end: {name} -->"
        between = re.compile(f"{re.escape(begin)}.*?{re.escape(end)}", re.DOTALL)
        marked = f"{begin}\n{block}\n{end}"
        page = between.sub(lambda _, text=marked: text, page)
    return page
