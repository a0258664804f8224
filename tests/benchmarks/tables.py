"""Tables of the benchmarks, and the passages of documents that show them."""

import math
import re
from collections.abc import Mapping, Sequence


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
