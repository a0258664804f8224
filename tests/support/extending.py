"""Apply the changes in the tables of docs/workflow.md to a copy of the project."""

import re
from dataclasses import dataclass
from pathlib import Path

from support.project import ROOT

PAGE = ROOT / "docs" / "workflow.md"
_ROW = re.compile(r"\| `(?P<file>[^`]+)` \| (?P<change>.+) \|")
_NEW = re.compile(r"new: as \[(?P<example>[^]]+)\]\((?P=example)\)")
_CODE = r"(?:`` ?(?P<{0}_long>.+?) ?``|`(?P<{0}>[^`]+)`)"
_EDIT = re.compile(
    r"(?P<how>below|instead of) " + _CODE.format("anchor") + ": " + _CODE.format("text")
)


@dataclass(frozen=True)
class Change:
    """A change of one file by an extension."""

    file: str
    text: str
    anchor: str = ""
    how: str = "new"

    def apply(self, folder: Path) -> None:
        """Apply the change to a copy of the project."""
        path = folder / self.file
        if self.how == "new":
            assert not path.exists(), f"{self.file} exists already"
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(self.text, encoding="utf-8")
            return
        content = path.read_text(encoding="utf-8")
        assert content.count(self.anchor) == 1, f"{self.file} holds {self.anchor!r} not once"
        before, after = content.split(self.anchor)
        if self.how == "below":
            line, _, after = after.partition("\n")
            path.write_text(f"{before}{self.anchor}{line}\n{self.text}\n{after}", encoding="utf-8")
        else:
            path.write_text(f"{before}{self.text}{after}", encoding="utf-8")


def changes(title: str) -> list[Change]:
    """Return the changes in the table of a section; fail if a row cannot be understood."""
    _, _, rest = PAGE.read_text(encoding="utf-8").partition(f"## {title}\n")
    section = rest.partition("\n##")[0]
    rows = [line for line in section.splitlines() if line.startswith("| `")]
    return [_change(_ROW.fullmatch(row)) for row in rows]


def _change(row: re.Match) -> Change:
    if new := _NEW.fullmatch(row["change"]):
        text = (PAGE.parent / new["example"]).read_text(encoding="utf-8")
        return Change(row["file"], text)
    edit = _EDIT.fullmatch(row["change"])
    anchor, text = edit["anchor"] or edit["anchor_long"], edit["text"] or edit["text_long"]
    return Change(row["file"], text, anchor, edit["how"])
