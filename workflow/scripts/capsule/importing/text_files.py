"""Read text files: tables of any dialect, and logs of a serial line."""

from types import SimpleNamespace

from capsule.importing.number_head import without_number_head
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
        The keys of lab.yaml.
    needed : int
        Smallest number of columns of numbers.

    Raises
    ------
    CapsuleError
        The file is not text, or no table can be recognised in it.
    """
    text, encoding = decode(content, keys.encoding)
    lines = split_lines(text, encoding, keys.comment, keys.skip_lines or 0)
    read = serial_table if is_serial_log(lines) else text_table
    return [without_number_head(read(lines, keys, needed), keys)]
