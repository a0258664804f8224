"""Read the blocks of code in the project's documents."""

import re
from dataclasses import dataclass

from support.project import ROOT

_PYTHON = re.compile(r"(import|from) \w")
# A comment above a block of Python that no test can run; it gives the reason. Then blocks: one in a
# fence, and one indented below an empty line.
_BLOCK = re.compile(
    r"<!-- not run: (?P<why>.+?) -->"
    r"|^(?P<space> *)(?P<fence>`{3,})(?P<language>\w*).*\n(?P<fenced>(?s:.*?))^ *(?P=fence)"
    r"|(?<=\n\n)(?P<indented>(?: {4}.*\n+)+)",
    re.MULTILINE,
)


@dataclass(frozen=True)
class Block:
    """A block of code of a document, without indentation; `language` is "" for an indented one.

    `not_run` is the document's reason why no test can run it.
    """

    document: str
    language: str
    text: str
    not_run: str

    @property
    def is_python(self):
        """Return whether the block is Python: by its language, or by its beginning if indented."""
        return self.language == "python" or (not self.language and bool(_PYTHON.match(self.text)))


def text_of(name):
    """Return the text of a file of the project, by its path from there."""
    return (ROOT / name).read_text(encoding="utf-8")


def documents():
    """Return the paths of README.md, config/README.md and the Markdown files in docs/."""
    return [ROOT / "README.md", ROOT / "config/README.md", *sorted((ROOT / "docs").glob("*.md"))]


def blocks(document):
    """Return the blocks of a document, both fenced and indented."""
    name, found, why = document.relative_to(ROOT).as_posix(), [], ""
    for each in _BLOCK.finditer(document.read_text(encoding="utf-8")):
        if each["why"]:
            why = each["why"]
        elif each["fence"]:
            text = re.sub(f"(?m)^{each['space']}", "", each["fenced"]).removesuffix("\n")
            found.append(Block(name, each["language"] or "text", text, why))
            why = ""
        else:
            text = re.sub("(?m)^    ", "", each["indented"]).rstrip()
            found.append(Block(name, "", text, why))
    return found


def all_blocks():
    """Return the blocks of all documents."""
    return [block for document in documents() for block in blocks(document)]
