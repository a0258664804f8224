"""Text files: tables of any dialect, and logs of a serial line."""

from types import SimpleNamespace

from capsule.importing.serial_log import is_serial_log, serial_table
from capsule.importing.source_table import SourceTable
from capsule.importing.text_lines import decode, split_lines
from capsule.importing.text_table import text_table


def read_text(content: bytes, keys: SimpleNamespace, needed: int) -> list[SourceTable]:
    """Read the table of a text file.

    Parameters
    ----------
    content : bytes
        The file.
    keys : SimpleNamespace
        What lab.yaml says.
    needed : int
        Number of columns of numbers that there must be.

    Raises
    ------
    CapsuleError
        It is no text, or holds no table that can be told.
    """
    text, encoding = decode(content, keys.encoding)
    lines = split_lines(text, encoding, keys.comment, keys.skip_lines or 0)
    read = serial_table if is_serial_log(lines) else text_table
    return [read(lines, keys, needed)]
