"""Read logs of a serial line, with the Arduino IDE's time stamps or its plotter's labels."""

import re
from types import SimpleNamespace

import numpy as np

from capsule.importing.number_style import POINT
from capsule.importing.source_table import Column, SourceTable
from capsule.importing.text_lines import TextLines
from capsule.importing.text_table import missing_words, text_column, text_table

STAMP_NAME = "serial monitor"
_STAMP = re.compile(r"\s*([0-9]{1,2}:[0-9]{2}:[0-9]{2}(?:[.,][0-9]+)?)\s*->\s?(.*)")
_LABELLED = re.compile(r"([A-Za-z_][\w .#-]*?)\s*[:=]\s*([+-]?[0-9.]+(?:[eE][+-]?[0-9]+)?|nan)")
# Least share of the lines that must look like those of a serial log.
_LEAST_SHARE = 0.5


def is_serial_log(text: TextLines) -> bool:
    """Return whether lines have a serial monitor's time stamps, or labels before readings."""
    some = [line for _, line in text.lines[:200]]
    fitting = sum(bool(_STAMP.fullmatch(line) or _labels(line)) for line in some)
    return bool(some) and fitting > _LEAST_SHARE * len(some)


def _labels(line: str) -> tuple[str, ...]:
    """Return the labels of a line; empty if it holds anything but labelled numbers."""
    rest = re.sub(r"[\s,;|]+", "", _LABELLED.sub("", line))
    return tuple(match[1].strip() for match in _LABELLED.finditer(line)) if not rest else ()


def serial_table(text: TextLines, keys: SimpleNamespace, needed: int) -> SourceTable:
    """Read the table in the log of a serial line; lines without a whole sample are passed over.

    Parameters
    ----------
    text : TextLines
        The file's lines.
    keys : SimpleNamespace
        The keys of lab.yaml.
    needed : int
        Least number of columns of numbers.

    Raises
    ------
    CapsuleError
        If there is no table, or several dialects fit.
    """
    stamps, lines = {}, []
    for number, line in text.lines:
        match = _STAMP.fullmatch(line)
        if match:
            stamps[number] = match[1]
        if rest := (match[2] if match else line).strip():
            lines.append((number, rest))
    bare = TextLines(tuple(lines), text.comments, text.encoding)
    table = _labelled(bare, keys) or text_table(bare, keys, needed, tolerant=True)
    if not stamps or table.lines is None:
        return table
    texts = np.array([stamps.get(number, "") for number in table.lines.tolist()], dtype=object)
    unstamped = np.flatnonzero(texts == "")
    clock = Column(STAMP_NAME, np.full(texts.size, np.nan), "clock", texts, np.arange(texts.size))
    if unstamped.size:
        return table
    return SourceTable(
        (clock, *table.columns),
        lines=table.lines,
        notes=table.notes,
        reading=table.reading,
        passed_over=table.passed_over,
    )


def _labelled(text: TextLines, keys: SimpleNamespace) -> SourceTable | None:
    """Return the table of labelled numbers; None if the lines have no labels."""
    labels = [_labels(line) for _, line in text.lines]
    usual = max(set(labels), key=labels.count, default=())
    if not usual or labels.count(usual) < _LEAST_SHARE * len(labels):
        return None
    whole = [
        (number, [match[2] for match in _LABELLED.finditer(line)])
        for (number, line), each in zip(text.lines, labels, strict=True)
        if each == usual
    ]
    taken = {number for number, _ in whole}
    cells = zip(*(row for _, row in whole), strict=True)
    missing = missing_words(keys)
    return SourceTable(
        tuple(
            text_column(name, "", each, POINT, missing)
            for name, each in zip(usual, cells, strict=True)
        ),
        lines=np.array([number for number, _ in whole]),
        notes=text.notes,
        reading={"encoding": text.encoding},
        passed_over=tuple(number for number, _ in text.lines if number not in taken),
    )
