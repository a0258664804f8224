"""docs/files.md names the files that a recording passes."""

import re

from capsule.engine.keys import imported_files
from support.project import ROOT

WORKFLOW = ROOT / "workflow"
SECTION = (
    (ROOT / "docs/files.md")
    .read_text(encoding="utf-8")
    .partition("### What a recording passes\n")[2]
    .partition("\n### ")[0]
)


def test_the_page_names_files_that_are_there_and_that_each_step_uses():
    rows = re.findall(r"^\| `(\w+)` \| (.*) \|$", SECTION, re.MULTILINE)
    assert [step for step, _ in rows] == ["preprocess", "list", "describe", "evaluate", "report"]
    for step, cell in rows:
        used = imported_files(WORKFLOW / f"scripts/{step}.py", ["capsule.detectors.taught"])
        folder = ""
        # A folder stands before the files in it, up to a semicolon.
        for name, rest in re.findall(r"`([^`]+)`([^`]*)", cell):
            path = WORKFLOW / folder / name
            assert path.exists(), name
            if path.parts[-2:][0] != "scripts" and path.suffix == ".py":
                assert path in used, (step, name)
            folder = name if name.endswith("/") else "" if ";" in rest else folder
