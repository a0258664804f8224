"""State from what and how the report was made."""

import re
from collections.abc import Iterable, Mapping, Sequence
from datetime import UTC, datetime
from typing import Any

from capsule.engine.project_state import ProjectState
from capsule.kinds import Cells, Row, Settings
from capsule.recordings.origin import combined_checksum
from capsule.words import enumerate_words, setting

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
_SCRIPTS = {"": "base", "^": "sup", "_": "sub"}


def page_values(
    recordings: Iterable[Row], settings: Settings, schema: Settings, printed: Settings
) -> Cells:
    """Return the page's values on what it was made from.

    Parameters
    ----------
    recordings : iterable of mapping
        From `capsule.page.recordings.recording_rows`.
    settings, schema : mapping
        The configuration and its JSON Schema.
    printed : mapping
        Content of paper.yaml.

    Returns
    -------
    dict
        ``configuration``, ``recordings_checksum``, ``paper`` and ``equation`` (the printed number
        of each equation, by its label).
    """
    equations = printed["equations"]
    checksums = {row["recording"]: row["sha256"] for row in recordings if row["sha256"]}
    return {
        "configuration": configuration_table(settings, schema, printed),
        "recordings_checksum": combined_checksum(checksums),
        "paper": printed,
        "equation": {label: cited(f"eq. {label}", equations) for label in equations},
    }


def how_made(
    code: Mapping[str, str],
    versions: Sequence[tuple[str, str]],
    made: datetime,
    state: ProjectState,
) -> Cells:
    """Return the page's values on the code that made it and the date.

    Parameters
    ----------
    code : mapping of str to str
        SHA-256 of each file of the code, by file name.
    versions : sequence of (str, str)
        Names of packages and their versions.
    made : datetime
        The time of making, with its time zone.
    state : ProjectState
        The project's state.

    Returns
    -------
    dict
        ``project``, ``software`` (a sentence that names the programs, each with its version and
        its reference), ``code_checksum``, ``versions`` and ``made``.
    """
    programs = [f"{name} {version} [{REFERENCES[name]}]" for name, version in versions]
    return {
        "project": state.text(),
        "commit": (state.commit or "")[:8],
        "software": f"The results were made by {state.text()}, with {enumerate_words(programs)}.",
        "code_checksum": combined_checksum(code),
        "versions": versions,
        "made": made.astimezone(UTC).strftime("%Y-%m-%d %H:%M UTC"),
    }


def configuration_table(config: Settings, schema: Settings, printed: Settings) -> list[Cells]:
    """Return every key of the configuration with the paper's value; parameters as in `page_values`.

    Returns
    -------
    list of dict
        ``key``, ``value``, ``symbol`` (from `typeset`), ``unit``, ``description``, ``paper``,
        ``where`` and ``differs``; ``paper`` is empty if the paper gives no number.
    """
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
    """Return a citation of the paper in which equations have their printed numbers.

    Parameters
    ----------
    where : str
        A section, or ``eq.`` and the label of an equation in the paper's source.
    equations : sequence of str
        The labels, in the order of the paper's numbers.

    Returns
    -------
    str
        For example ``Eq. 2``.

    Raises
    ------
    ValueError
        The paper has no equation of that label.
    """
    return _LABEL.sub(lambda match: f"Eq. {equations.index(match[1]) + 1}", where)


def typeset(symbol: str) -> list[dict[str, str]]:
    """Return the parts of a symbol such as ``Delta mu^hor``, for HTML.

    Parameters
    ----------
    symbol : str
        Letters and names of Greek letters; ``^`` raises and ``_`` lowers what follows.

    Returns
    -------
    list of dict
        ``text`` and ``kind``: ``upright`` for the sign of a difference, ``base`` for a variable,
        ``sup`` or ``sub``.
    """
    parts = []
    for script, name in re.findall(r"([\^_]?)([A-Za-z]+)", symbol):
        kind = "upright" if name == "Delta" else _SCRIPTS[script]
        parts.append({"kind": kind, "text": _GREEK.get(name, name)})
    return parts
