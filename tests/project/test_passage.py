"""docs/files.md names the files that a recording passes."""

import re

import pytest

from capsule.engine.keys import imported_files
from support.project import ROOT

WORKFLOW = ROOT / "workflow"
SECTION = (
    (ROOT / "docs/files.md")
    .read_text(encoding="utf-8")
    .partition("### What a recording passes\n")[2]
    .partition("\n### ")[0]
)


def files_in(cell):
    """Return the paths in a cell of the table, each in the folder that the cell names for it."""
    found, folder = [], ""
    for name, rest in re.findall(r"`([^`]+)`([^`]*)", cell):
        if name.endswith("/"):
            folder = name
        else:
            found.append(f"{folder}{name}")
        folder = "" if ";" in rest else folder
    return found


def steps():
    rows = re.findall(r"^\| `(\w+)` \| (.*) \|$", SECTION, re.MULTILINE)
    return {step: files_in(cell) for step, cell in rows}


def test_each_file_that_is_named_is_there():
    passed = [name for names in steps().values() for name in names]
    assert len(set(passed)) == len(passed)
    assert all((WORKFLOW / name).is_file() for name in passed), passed
    assert list(steps()) == ["preprocess", "list", "describe", "evaluate", "report"]


@pytest.mark.parametrize("step", steps())
def test_the_modules_of_a_step_are_those_that_its_script_uses(step):
    script = WORKFLOW / f"scripts/{step}.py"
    used = imported_files(script, ["capsule.detectors.taught"])
    for name in steps()[step]:
        if name.startswith("scripts/capsule/"):
            assert WORKFLOW / name in used, name
