"""docs/files.md names the files that a recording passes, and they are few."""

import re

import pytest

from capsule.engine.keys import imported_files
from support.project import ROOT, Project

WORKFLOW = ROOT / "workflow"
SECTION = (
    (ROOT / "docs/files.md")
    .read_text(encoding="utf-8")
    .partition("### What a recording passes\n")[2]
    .partition("\n### ")[0]
)
# Notes the files whose functions a program calls.
TRACE = """
import atexit, os, sys
called = set()
def note(frame, event, argument):
    if event == "call" and frame.f_code.co_name not in ("<module>", "__getattr__"):
        # The body of a class runs once, where the module is imported.
        if frame.f_back is None or frame.f_back.f_code.co_name != "<module>":
            called.add(frame.f_code.co_filename)
sys.setprofile(note)
@atexit.register
def write():
    sys.setprofile(None)
    with open(os.path.join(os.environ["TRACED"], str(os.getpid())), "w") as stream:
        print(sys.argv[0], *sorted(called), sep="\\n", file=stream)
"""


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


def test_a_recording_passes_at_most_forty_files_on_its_way_to_its_row():
    passed = [name for names in steps().values() for name in names]
    assert len(set(passed)) == len(passed) <= 40
    assert all((WORKFLOW / name).is_file() for name in passed), passed
    assert list(steps()) == ["preprocess", "list", "describe", "evaluate", "report"]


@pytest.mark.parametrize("step", steps())
def test_the_modules_of_a_step_are_those_that_its_script_uses(step):
    script = WORKFLOW / f"scripts/{step}.py"
    used = imported_files(script, ["capsule.detectors.taught"])
    for name in steps()[step]:
        if name.startswith("scripts/capsule/"):
            assert WORKFLOW / name in used, name


@pytest.mark.workflow
@pytest.mark.slow
@pytest.mark.takes(20)
def test_no_other_module_handles_a_recording_before_it_is_judged(tmp_path):
    recordings = [f"{size}mm/r{run:02d}" for size in (0, 3) for run in range(1, 5)]
    project = Project.create(tmp_path / "project", recordings, particles=5, iterations=5)
    (tmp_path / "sitecustomize.py").write_text(TRACE)
    (tmp_path / "traced").mkdir()
    traced = {"PYTHONPATH": str(tmp_path), "TRACED": str(tmp_path / "traced")}
    run = project.snakemake("results/evaluation/predictions.csv", environment=traced)
    assert run.status == 0, run.output
    known = set(re.findall(r"\w+\.py", SECTION))
    seen = set()
    for path in (tmp_path / "traced").iterdir():
        script, *called = path.read_text(encoding="utf-8").splitlines()
        step = re.search(r"(\w+)\.py$", script)
        if step and step[1] in ("preprocess", "list", "describe"):
            seen |= {name.rpartition("/")[2] for name in called if "/workflow/scripts/" in name}
    assert {"preprocess.py", "wave.py", "listing.py", "search.py"} <= seen
    # Shared by programs that call no step, or by what is drawn.
    assert seen - known <= {"__init__.py", "packing.py"}
