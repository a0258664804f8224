"""State from what and how the report was made."""

import re
from collections.abc import Iterable, Mapping, Sequence
from datetime import UTC, datetime
from typing import Any

from capsule.engine.project import ProjectState
from capsule.kinds import Cells, Settings
from capsule.page.tables import Tables
from capsule.recordings.origin import combined_checksum
from capsule.words import setting

# Each program's entry in references.bib.
REFERENCES = {
    "Python": "python",
    "snakemake": "moelder2021snakemake",
    "numpy": "harris2020numpy",
    "scipy": "virtanen2020scipy",
    "pandas": "mckinney2010pandas",
    "matplotlib": "hunter2007matplotlib",
    "jinja2": "jinja",
    "uPlot": "uplot",
}

_LABEL = re.compile(r"\beq\. (\S+)")
_GREEK = {"Delta": "\u0394", "mu": "\u03bc", "sigma": "\u03c3"}
_TAGS = {"": "i", "^": "sup", "_": "sub"}


def page_values(tables: Tables) -> Cells:
    """Return the page's values on what it was made from."""
    printed, equations = tables.printed, tables.printed["equations"]
    known = tables.index.dropna(subset="sha256").set_index("recording")
    return {
        "configuration": configuration_table(tables.settings, tables.schema, printed),
        "recordings_checksum": combined_checksum(known["sha256"].to_dict()),
        "paper": printed,
        "equation": {label: cited(f"eq. {label}", equations) for label in equations},
    }


def how_made(
    code: Mapping[str, str],
    versions: Sequence[tuple[str, str]],
    made: datetime,
    state: ProjectState,
) -> Cells:
    """Return the page's values on the code that made it and the date."""
    return {
        "project": state.text(),
        "commit": (state.commit or "")[:8],
        "programs": [f"{name} {version} [{REFERENCES[name]}]" for name, version in versions],
        "code_checksum": combined_checksum(code),
        "versions": versions,
        "made": made.astimezone(UTC).strftime("%Y-%m-%d %H:%M UTC"),
    }


def configuration_table(config: Settings, schema: Settings, printed: Settings) -> list[Cells]:
    """Return every key of the configuration with the paper's value, empty if it gives no number."""
    rows = []
    for key, value, description in _leaves(config, schema):
        in_paper: Settings | None = printed["settings"].get(key)
        unit = description.get("unit", "")
        rows.append(
            {
                "key": key,
                "value": setting(value),
                "symbol": typeset(description.get("symbol", "")),
                "unit": "" if unit == "1" else unit,
                "description": description.get("description", ""),
                "paper": setting(in_paper["value"]) if in_paper else "",
                "where": cited(in_paper["where"], printed["equations"]) if in_paper else "",
                "differs": in_paper is not None and not _agrees(value, in_paper),
            }
        )
    return rows


def _leaves(
    config: Settings, schema: Settings, prefix: str = ""
) -> Iterable[tuple[str, Any, Settings]]:
    described_keys = schema.get("properties", {})
    # The schema has the order of the configuration file. Unknown keys raise an error earlier.
    for key in sorted(config, key=list(described_keys).index):
        value, described = config[key], described_keys[key]
        if isinstance(value, Mapping):
            yield from _leaves(value, described, f"{prefix}{key}.")
        else:
            yield f"{prefix}{key}", value, described


def _agrees(value: Any, in_paper: Settings) -> bool:  # noqa: ANN401
    """Return whether a value is the paper's; a range open at 0 may begin at any small number."""
    if in_paper.get("open_at_low_end"):
        low, high = in_paper["value"]
        return bool(value[1] == high and low < value[0] <= low + 0.01)
    return bool(value == in_paper["value"])


def cited(where: str, equations: Sequence[str]) -> str:
    """Return a citation such as ``eq. RMSE`` with the equation's printed number.

    The labels of `equations` are in the order of the paper's numbers; no other one can be cited.
    """
    return _LABEL.sub(lambda match: f"Eq. {equations.index(match[1]) + 1}", where)


def typeset(symbol: str) -> list[tuple[str, str]]:
    """Return the parts of a symbol such as ``Delta mu^hor``, each with its element of HTML.

    ``^`` raises and ``_`` lowers what follows; the sign of a difference stays upright.
    """
    parts = re.findall(r"([\^_]?)([A-Za-z]+)", symbol)
    return [
        ("span" if name == "Delta" else _TAGS[script], _GREEK.get(name, name))
        for script, name in parts
    ]
