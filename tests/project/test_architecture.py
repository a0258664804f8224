"""Imports lead down, only some modules know files, and each script is a step of the rules."""

import ast
import re
from functools import cache
from graphlib import TopologicalSorter

import pytest

from capsule.detectors.registry import DETECTORS
from capsule.engine.keys import imported_files
from capsule.figures.registry import FIGURES
from support.project import ROOT

SCRIPTS = ROOT / "workflow" / "scripts"
MODULES = {
    ".".join(path.relative_to(folder).with_suffix("").parts): path
    for folder in (SCRIPTS, SCRIPTS.with_name("studies"))
    for path in sorted(folder.rglob("*.py"))
    if path.name != "__init__.py"
}
# Layers from the lowest to the highest; the longest name that fits gives a module's layer. Two
# modules beside the folders of the library use what is in them.
FLOORS = [
    *("capsule", "capsule.recordings", "capsule.commands.options", "capsule.method"),
    *("capsule.engine.project", "capsule.engine.jobs"),
    "capsule.engine.keys",
    *("capsule.store", "capsule.recordings.held_out", "capsule.phantom", "capsule.parts"),
    "capsule.detectors",
    *("capsule.recordings.acceptance", "capsule.engine.configuration"),
    *("capsule.phantom.command", "capsule.survey", "capsule.phantom.simulated_bench"),
    *("capsule.figures.style", "capsule.parts.drawings", "capsule.evaluation", "capsule.figures"),
    *("capsule.interface", "capsule.page", "capsule.parts.sheets", "capsule.parts.files"),
    "capsule.parts.command",
    *("capsule.engine", "capsule.commands.new", "capsule.commands.report", "capsule.judging"),
    "capsule.bench",
    *("capsule.importing", "capsule.exporting", "capsule.commands", "capsule.__main__"),
    *("phantom_study", "scorer_teaching", "scripts"),
]
# Only modules of these names, in any folder of the library, know files, folders and processes.
ON_FILES = {"files", "results", "project", "keys", "configuration", "held_out", "archive", "jobs"}
ON_FILES |= {"described", "listed", "__main__", "cli", "command", "new", "forget", "compare"}
# These call git, Slurm or Snakemake, and look after its runs.
ON_PROGRAMS = {"run", "report"}
# These folders are at work on files, boards and other programs as a whole.
AT_WORK = ("capsule.bench.", "capsule.exporting.", "capsule.importing.", "capsule.judging.")
SYSTEM = {"pathlib", "os", "shutil", "glob", "tempfile", "subprocess", "multiprocessing"}


def floor(module):
    """Return the number of a module's layer; scripts are the highest layer."""
    fitting = [name for name in FLOORS if f"{module}.".startswith(f"{name}.")]
    return FLOORS.index(max(fitting, key=len, default=FLOORS[-1]))


@cache
def imported(path):
    """Return the modules that a file imports, also inside functions."""
    names = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            names |= {node.module, *(f"{node.module}.{alias.name}" for alias in node.names)}
    return names


def imports_of(module):
    """Return the modules of the project that a module imports."""
    return imported(MODULES[module]) & MODULES.keys()


def test_imports_lead_down_and_in_no_circle():
    for module in MODULES:
        upward = [other for other in imports_of(module) if floor(other) > floor(module)]
        assert not upward, module
    # Its error names the circle.
    TopologicalSorter({name: imports_of(name) for name in MODULES}).prepare()


def test_only_modules_that_say_so_in_their_name_know_files_and_none_snakemake():
    library = {name: imported(path) for name, path in MODULES.items() if "capsule." in name}
    assert not [name for name, used in library.items() if "snakemake" in used]
    knowing = [name for name, used in library.items() if used & SYSTEM]
    names = {name.rpartition(".")[2] for name in knowing if not name.startswith(AT_WORK)}
    assert names == ON_FILES | ON_PROGRAMS


STEPS = sorted(path.stem for path in SCRIPTS.glob("*.py"))
SCIENCE = {"preprocess", "fit", "describe", "list", "templates", "evaluate", "detect"}
SHOWN = ("capsule/words.py", "capsule/page/", "capsule/figures/")


# Kills: a changed word or figure that makes every verdict again.
@pytest.mark.parametrize("step", STEPS)
def test_no_step_rests_on_solids_or_the_interface_and_none_of_science_on_what_is_shown(step):
    modules = [row.module for row in DETECTORS.values()]
    if step not in SCIENCE:
        modules += FIGURES.values()
    used = imported_files(SCRIPTS / f"{step}.py", modules)
    assert SCRIPTS / "capsule/errors.py" in used
    for path in used:
        name = path.relative_to(SCRIPTS).as_posix()
        elsewhere = ("capsule/interface/", "capsule/importing/", "capsule/bench/")
        assert not name.startswith((*elsewhere, *(SHOWN if step in SCIENCE else ())))
        assert not {"manifold3d", "OCP"} & {each.partition(".")[0] for each in imported(path)}


def test_each_script_is_a_step_of_the_rules():
    rules = [path.read_text(encoding="utf-8") for path in (ROOT / "workflow/rules").glob("*.smk")]
    assert sorted({*re.findall(r'= step\(\s*"(\w+)"', "".join(rules))}) == STEPS
