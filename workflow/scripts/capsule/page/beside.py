"""Decide whether the evidence of a large archive goes into files beside the page, and make them.

A page on disk can read a file beside it only as a script. Each such file therefore passes two texts
per recording, in letters and digits only: deflated JSON in base64. So no name or header of a
recording can run as code. The first text is the one that the rule describe has stored.

This module imports nothing heavy, because the Snakefile calls `stands_beside`.
"""

import hashlib
import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from capsule.kinds import Settings

# In bytes. _PAGE: figures and all else of constant size. _RECORDING: row, verdicts and header.
# _SENSOR: envelope and matrix, 250 points each. _READING: 16 bits in base64.
_PAGE, _RECORDING, _SENSOR, _READING = 2.5e6, 5400, 670, 8 / 3
# A file of this many recordings has about 200 kB, which loads at once.
RECORDINGS_A_FILE = 32


@dataclass(frozen=True)
class FilesBeside:
    """The files beside the page, and what the page itself shows of their recordings.

    Attributes
    ----------
    folder : str
        Name of the folder beside the page.
    files : sequence of str
        Names of the files without their suffixes, in the order of their recordings.
    each : int
        Number of recordings in one file.
    qualities : mapping of str to str
        The quality of each accepted recording in words.
    """

    folder: str
    files: Sequence[str]
    each: int
    qualities: Mapping[str, str]

    def quality(self, name: str) -> str:
        """Return the recording's quality in words."""
        return self.qualities[name]


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


def data_file(number: int, texts: Iterable[tuple[str, str]]) -> tuple[str, str]:
    """Return a file that goes beside the page.

    Parameters
    ----------
    number : int
        The file's number among all, from 0 on.
    texts : iterable of (str, str)
        The two texts of each of its recordings, from `capsule.page.packing.deflated`.

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
