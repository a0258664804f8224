"""Read the blocks of code in the project's documents."""

import re
from dataclasses import dataclass
from pathlib import Path

from support.project import ROOT

# A comment above a block of Python that no test can run; it gives the reason.
NOT_RUN = re.compile(r"<!-- not run: (.+?) -->")
_PYTHON = re.compile(r"(import|from) \w")


@dataclass(frozen=True)
class Block:
    """A block of code.

    Attributes
    ----------
    document : str
        Its document, relative to the project.
    language : str
        Language that a fenced block names; ``""`` for an indented block.
    text : str
        Code without indentation.
    not_run : str
        Reason in the document why no test can run it; empty for a block that is run.
    """

    document: str
    language: str
    text: str
    not_run: str

    @property
    def is_python(self) -> bool:
        """Return whether the block is Python: by its language, or by its beginning if indented."""
        return self.language == "python" or (not self.language and bool(_PYTHON.match(self.text)))


def documents() -> list[Path]:
    """Return the paths of README.md, config/README.md and the Markdown files in docs/."""
    return [
        ROOT / "README.md",
        ROOT / "config/README.md",
        *sorted((ROOT / "docs").glob("*.md")),
    ]


def blocks(document: Path) -> list[Block]:
    """Return the blocks of a document, both fenced and indented."""
    name = document.relative_to(ROOT).as_posix()
    lines = document.read_text(encoding="utf-8").splitlines()
    result, index, why = [], 0, ""
    while index < len(lines):
        line, start = lines[index], index
        if mark := NOT_RUN.search(line):
            why = mark[1]
        if fence := re.match(r"( *)(`{3,})(\w*)", line):
            index += 1
            while not lines[index].strip().startswith(fence[2]):
                index += 1
            text = [each.removeprefix(fence[1]) for each in lines[start + 1 : index]]
            result.append(Block(name, fence[3] or "text", "\n".join(text), why))
            why = ""
        elif line.startswith("    ") and (not start or not lines[start - 1].strip()):
            while index < len(lines) and (lines[index].startswith("    ") or not lines[index]):
                index += 1
            text = "\n".join(each[4:] for each in lines[start:index]).rstrip()
            result.append(Block(name, "", text, why))
            index, why = index - 1, ""
        index += 1
    return result


def all_blocks() -> list[Block]:
    """Return the blocks of all documents."""
    return [block for document in documents() for block in blocks(document)]
