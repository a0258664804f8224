"""Where the page's evidence stands: inside the page, or in files beside it for a large archive.

A page on disk can read a file beside it only as a script. Such a file therefore hands over one text
a recording, which is nothing but letters and digits: deflated JSON in base64. No name and no header
of a recording stands in it as code, or could.

Imports nothing heavy: the Snakefile asks whether there will be files beside the page.
"""

import base64
import hashlib
import itertools
import json
import zlib
from collections.abc import Iterable, Iterator

from capsule.kinds import Settings

# In bytes: the figures and all that does not grow; a recording's row, verdicts and header; of a
# sensor the envelope and the matrix, 250 points each; a reading, 16 bits in base64.
_PAGE, _RECORDING, _SENSOR, _READING = 2.5e6, 5400, 670, 8 / 3
# So many recordings share a file: some 200 kB, read in a moment.
RECORDINGS_A_FILE = 32


def stands_beside(recordings: int, settings: Settings) -> bool:
    """Tell whether the evidence stands beside the page, which would become too large with it.

    Parameters
    ----------
    recordings : int
        Number of recordings.
    settings : mapping
        The configuration; each recording counts as one of the longest that it allows.
    """
    sensors, length = settings["recording"]["sensors"], settings["preprocessing"]["length"]
    one: float = _RECORDING + sensors * (_SENSOR + length * _READING)
    most_bytes: float = 1e6 * settings["report"]["max_megabytes"]
    return _PAGE + recordings * one > most_bytes


def data_files(evidence: Iterable[tuple[str, str]]) -> Iterator[tuple[str, str]]:
    """Yield the files that stand beside the page, one at a time.

    Parameters
    ----------
    evidence : iterable of (str, str)
        Name and JSON of each recording, from `capsule.page.evidence.archive_evidence`.

    Yields
    ------
    name : str
        The file's name without its suffix: a number, and the start of the content's SHA-256. A page
        reads the files that it was made with, and no others.
    script : str
        The file's content.
    """
    contents = (content for _, content in evidence)
    for number in itertools.count():
        texts = [_deflated(content) for content in itertools.islice(contents, RECORDINGS_A_FILE)]
        if not texts:
            return
        listed = json.dumps(texts, separators=(",", ":"))
        name = f"{number:05d}-{hashlib.sha256(listed.encode('ascii')).hexdigest()[:16]}"
        yield name, f'EvidenceStore.receive("{name}",{listed});\n'


def _deflated(content: str) -> str:
    return base64.b64encode(zlib.compress(content.encode("utf-8"), 6)).decode("ascii")
