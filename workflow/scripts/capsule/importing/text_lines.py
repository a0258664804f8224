"""Split the bytes of a text file into lines, and a line into cells."""

import csv
import re
from collections.abc import Mapping
from dataclasses import dataclass

from capsule.errors import CapsuleError

DELIMITERS = {"comma": ",", "semicolon": ";", "tab": "\t", "space": " ", "bar": "|", "none": ""}
_COMMENT = ("#", "%", "//")
_NOTE = re.compile(r"\s*([A-Za-z][A-Za-z0-9_ ]{0,40}?)\s*[:=]\s*(.+)")
# Keys of a file's own header lines that the recording keeps, or that tell how to read it.
NOTED = (
    "adc_bits",
    "vref_v",
    "series_ohm",
    "site",
    "session",
    "setup",
    "unit",
    "source",
    "started",
)
_LONGEST_LINE = 100_000


@dataclass(frozen=True)
class TextLines:
    """The lines and comments of a text file.

    Attributes
    ----------
    lines : tuple of (int, str)
        Number and text of each line that is neither blank nor a comment.
    comments : tuple of (int, str)
        Number and text of each comment, without its mark.
    encoding : str
        Encoding of the bytes.
    """

    lines: tuple[tuple[int, str], ...]
    comments: tuple[tuple[int, str], ...]
    encoding: str

    @property
    def notes(self) -> Mapping[str, str]:
        """The comments of the form ``key: value``, by key.

        Raises
        ------
        CapsuleError
            If two lines give a key of `NOTED` different values.
        """
        notes: dict[str, str] = {}
        lines: dict[str, int] = {}
        for number, text in self.comments:
            if not (match := _NOTE.fullmatch(text)):
                continue
            key, value = match[1], match[2].strip()
            if key in NOTED and notes.get(key, value) != value:
                raise CapsuleError(
                    f"lines {lines[key]} and {number} name two values of {key}, "
                    f"{notes[key][:60]!r} and {value[:60]!r}; delete the line that is wrong"
                )
            notes[key], lines[key] = value, number
        return notes


def decode(content: bytes, encoding: str | None) -> tuple[str, str]:
    """Return a file's text and its encoding.

    Parameters
    ----------
    content : bytes
        The file.
    encoding : str or None
        Encoding in lab.yaml; None to detect it.

    Returns
    -------
    text, encoding : str

    Raises
    ------
    CapsuleError
        If the bytes are not text.
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
            # The codecs utf-16-le and utf-16-be leave a byte-order mark in the text.
            return text.lstrip("\ufeff"), guess.removesuffix("-le").removesuffix("-be")
        fault = "it holds null characters"
    raise CapsuleError(
        f"the file is not readable text: {fault}; use --encoding, or export the file as text"
    )


def _likely(content: bytes) -> list[str]:
    if content.startswith((b"\xff\xfe", b"\xfe\xff")):
        return ["utf-16"]
    head = content[:4000]
    if b"\x00" in head:
        # In UTF-16, a Latin letter has its null byte second (little endian) or first (big endian).
        low, high = head[0::2].count(0), head[1::2].count(0)
        return ["utf-16-le"] if high > low else ["utf-16-be"]
    return ["utf-8", "cp1252", "latin-1"]


def split_lines(text: str, encoding: str, comment: str | None, skip: int) -> TextLines:
    """Return the lines and the comments of a text.

    Parameters
    ----------
    text : str
        The file.
    encoding : str
        Encoding of its bytes.
    comment : str or None
        An additional mark of comments.
    skip : int
        Number of lines to skip above the table.
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
                f"line {number} has {len(line)} characters, but a line of a table has at most "
                f"{_LONGEST_LINE}; choose another file"
            )
        mark = next((each for each in marks if stripped.startswith(each)), None)
        if mark is None:
            lines.append((number, line))
        else:
            comments.append((number, stripped[len(mark) :].lstrip(mark).strip()))
    return TextLines(tuple(lines), tuple(comments), encoding)


def split_cells(line: str, delimiter: str) -> list[str]:
    """Return the cells of a line, without the blanks around them.

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
