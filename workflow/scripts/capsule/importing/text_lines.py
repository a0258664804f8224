"""From the bytes of a text file to its lines, and from a line to its cells."""

import csv
import re
from collections.abc import Mapping
from dataclasses import dataclass

from capsule.errors import CapsuleError

DELIMITERS = {"comma": ",", "semicolon": ";", "tab": "\t", "space": " ", "bar": "|", "none": ""}
_COMMENT = ("#", "%", "//")
_NOTE = re.compile(r"\s*([A-Za-z][A-Za-z0-9_ ]{0,40}?)\s*[:=]\s*(.+)")
_LONGEST_LINE = 100_000


@dataclass(frozen=True)
class TextLines:
    """The lines of a text file that are no comments.

    Attributes
    ----------
    lines : tuple of (int, str)
        Number and text of each line that is not blank.
    comments : tuple of (int, str)
        The comments, without what begins them.
    encoding : str
        How the bytes were read.
    """

    lines: tuple[tuple[int, str], ...]
    comments: tuple[tuple[int, str], ...]
    encoding: str

    @property
    def notes(self) -> Mapping[str, str]:
        """What the comments say as ``key: value``."""
        matches = [_NOTE.fullmatch(text) for _, text in self.comments]
        return {match[1]: match[2].strip() for match in matches if match}


def decode(content: bytes, encoding: str | None) -> tuple[str, str]:
    """Turn bytes into text.

    Parameters
    ----------
    content : bytes
        The file.
    encoding : str or None
        What lab.yaml says; None to find out.

    Returns
    -------
    text, encoding : str

    Raises
    ------
    CapsuleError
        The bytes are no text.
    """
    if not content:
        raise CapsuleError("the file is empty; export it again")
    guesses = [encoding] if encoding else _likely(content)
    for guess in guesses:
        try:
            text = content.decode("utf-8-sig" if guess == "utf-8" else guess)
        except UnicodeDecodeError as error:
            fault = f"byte {error.start + 1} is not {guess}"
            continue
        if "\x00" not in text:
            # Of UTF-16 without its mark the codec cuts nothing off.
            return text.lstrip("\ufeff"), guess.removesuffix("-le").removesuffix("-be")
        fault = "it holds null characters"
    raise CapsuleError(
        f"the file is no text that can be read: {fault}; give --encoding, or export it as text"
    )


def _likely(content: bytes) -> list[str]:
    if content.startswith((b"\xff\xfe", b"\xfe\xff")):
        return ["utf-16"]
    head = content[:4000]
    if b"\x00" in head:
        # Latin letters have their null byte second (little endian) or first.
        low, high = head[0::2].count(0), head[1::2].count(0)
        return ["utf-16-le"] if high > low else ["utf-16-be"]
    return ["utf-8", "cp1252", "latin-1"]


def split_lines(text: str, encoding: str, comment: str | None, skip: int) -> TextLines:
    """Split a text into lines, and set comments apart.

    Parameters
    ----------
    text : str
        The file.
    encoding : str
        How its bytes were read.
    comment : str or None
        What else begins a comment.
    skip : int
        Number of lines above the table that are passed over.
    """
    marks = (*_COMMENT, comment) if comment else _COMMENT
    lines, comments = [], []
    plain = text.replace("\r\n", "\n").replace("\r", "\n")
    for number, line in enumerate(plain.split("\n"), start=1):
        stripped = line.strip()
        if number <= skip or not stripped:
            continue
        if len(line) > _LONGEST_LINE:
            raise CapsuleError(
                f"line {number} has {len(line)} characters, a line of a table has at most "
                f"{_LONGEST_LINE}; is this another file?"
            )
        mark = next((each for each in marks if stripped.startswith(each)), None)
        if mark is None:
            lines.append((number, line))
        else:
            comments.append((number, stripped[len(mark) :].lstrip(mark).strip()))
    return TextLines(tuple(lines), tuple(comments), encoding)


def split_cells(line: str, delimiter: str) -> list[str]:
    """Split a line into cells without the blanks around them.

    Parameters
    ----------
    line : str
        One line.
    delimiter : str
        A key of `DELIMITERS`.
    """
    sign = DELIMITERS[delimiter]
    if not sign:
        return [line.strip().strip('"')]
    if '"' in line:
        cells = next(csv.reader([line], delimiter=sign, skipinitialspace=True), [])
        return [cell.strip() for cell in cells if cell.strip() or sign != " "]
    if sign == " ":
        return line.split()
    return [cell.strip() for cell in line.split(sign)]
