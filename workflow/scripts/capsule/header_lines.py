"""The ``# key: value`` lines above the column names of a recording.

The Snakefile reads them at every start, so this module imports only fast modules.
"""

from collections.abc import Sequence

from capsule.errors import RecordingError

# No recording comes near this limit. A file beyond it is something else.
_LONGEST_HEADER = 1000
# The report shows every header in full.
_MOST_HEADER_CHARACTERS = 10_000


def one_line_end(text: str) -> str:
    """Return text whose lines all end in a line feed, whatever the system that wrote them."""
    # splitlines() would also split at form feeds and other characters, which editors do not do.
    return text.replace("\r\n", "\n").replace("\r", "\n")


def split_header(lines: Sequence[str]) -> tuple[dict[str, str], int]:
    """Return the header lines of a recording, and the index of the line of column names.

    Parameters
    ----------
    lines : sequence of str
        The lines of the file, or its first lines.

    Returns
    -------
    header : dict of str to str
        The values by their keys.
    index : int
        The number of lines if all of them are header lines.

    Raises
    ------
    RecordingError
        The header is too long to be one.
    """
    header: dict[str, str] = {}
    characters = 0
    for index, line in enumerate(lines):
        stripped = line.strip()
        if stripped and not stripped.startswith("#"):
            return header, index
        key, colon, value = stripped.lstrip("#").partition(":")
        if colon:
            header[key.strip()] = value.strip()
        characters += len(stripped)
        if characters > _MOST_HEADER_CHARACTERS:
            raise RecordingError(
                f"line {index + 1}: the header lines hold more than {_MOST_HEADER_CHARACTERS} "
                "characters; keep long notes in a separate file"
            )
        if index >= _LONGEST_HEADER:
            raise RecordingError(f"the first {_LONGEST_HEADER} lines hold no column names")
    return header, len(lines)
