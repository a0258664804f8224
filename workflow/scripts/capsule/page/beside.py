"""Decide whether the evidence of a large archive goes into files beside the page, and write them.

A page on disk can read a file beside it only as a script. Each such file therefore passes two texts
per recording, in letters and digits only: deflated JSON in base64. So no name or header of a
recording can run as code. The first text is the one that the rule describe has stored.

This module imports nothing heavy, because the Snakefile calls `stands_beside`.
"""

import hashlib
import json
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

from capsule import files
from capsule.kinds import Cells, Row, Settings, Spread

# In bytes. _PAGE: figures and all else of constant size. _RECORDING: row, verdicts and header.
# _SENSOR: envelope and matrix, 250 points each. _READING: 16 bits in base64.
_PAGE, _RECORDING, _SENSOR, _READING = 2.5e6, 5400, 670, 8 / 3
# A file of this many recordings has about 200 kB, which loads at once.
RECORDINGS_A_FILE = 32


def stands_beside(recordings: int, settings: Settings) -> bool:
    """Return whether the evidence goes into files beside the page, to keep the page small.

    Parameters
    ----------
    recordings : int
        Number of recordings.
    settings : mapping
        The configuration; each recording counts with the largest length that it allows.
    """
    sensors, length = settings["recording"]["sensors"], settings["preprocessing"]["length"]
    one: float = _RECORDING + sensors * (_SENSOR + length * _READING)
    most_bytes: float = 1e6 * settings["report"]["max_megabytes"]
    return _PAGE + recordings * one > most_bytes


def write_beside(
    folder: Path,
    rows: Sequence[Row],
    texts: Callable[[Iterable[Row]], Iterable[tuple[str, str]]],
    spread: Spread = map,
) -> Cells:
    """Write the files beside the page, each with only its own recordings in memory.

    Parameters
    ----------
    folder : Path
        ``results/report`` for the page ``results/report.html``.
    rows : sequence of mapping
        The accepted recordings.
    texts : callable
        Returns the two texts of each of some rows, from `capsule.page.packing.deflated`.
    spread : callable
        Calls a function with the number of each file, like `map`.

    Returns
    -------
    dict
        What the page's scripts need to know: ``folder``, its name; ``files``, their names without
        suffixes, in the order of their recordings; and ``each``, how many recordings a file has.
    """
    folder.mkdir(parents=True, exist_ok=True)
    each = RECORDINGS_A_FILE

    def write_file(number: int) -> str:
        name, script = data_file(number, texts(rows[number * each : (number + 1) * each]))
        with files.write_whole(folder / f"{name}.js") as stream:
            stream.write(script)
        return name

    names = list(spread(write_file, range(-(-len(rows) // each))))
    return {"folder": folder.name, "files": names, "each": each}


def data_file(number: int, texts: Iterable[tuple[str, str]]) -> tuple[str, str]:
    """Return a file that goes beside the page.

    Parameters
    ----------
    number : int
        The file's number among all, from 0 on.
    texts : iterable of (str, str)
        The two texts of each of its recordings.

    Returns
    -------
    name : str
        The file's name without its suffix: the number, and the start of the content's SHA-256. So
        a page reads only the files that were made with it.
    script : str
        The file's content.
    """
    listed = json.dumps(list(texts), separators=(",", ":"))
    name = f"{number:05d}-{hashlib.sha256(listed.encode('ascii')).hexdigest()[:16]}"
    return name, f'EvidenceStore.receive("{name}",{listed});\n'
