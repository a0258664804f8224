"""The code has the structure that the documentation describes: layers, files and sizes."""

import ast
from functools import cache
from graphlib import CycleError, TopologicalSorter

import pytest

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
FLOORS = (
    "capsule",
    "capsule.geometry",
    "capsule.phantom",
    "capsule.parts",
    "capsule.detectors",
    "capsule.configuration",
    "capsule.phantom.command",
    "capsule.survey",
    "capsule.evaluation",
    "capsule.figures",
    "capsule.interface",
    "capsule.page",
    "capsule.parts.sheets",
    "capsule.parts.command",
    "capsule.run",
    "capsule.importing",
    "capsule.exporting",
    "capsule.bench",
    "phantom_study",
    "scorer_teaching",
    "scripts",
)
FRONTS = {"study_phantom", "teach_scorer"}
# Only modules of these names, in any folder of the library, know files, folders and processes. All
# others are functions on arrays.
ON_FILES = {"files", "results", "project", "locks", "forks", "keys", "configuration", "held_out"}
ON_FILES |= {"archive", "described", "data_files", "plot_data", "listed"}
# The command, and those of subjects.
ON_FILES |= {"__main__", "cli", "command", "completion", "new"}
# These call git, Slurm or Snakemake, and look after its runs.
ON_PROGRAMS = {"project_state", "run", "verify", "workflow_call"}
# These folders are at work on files, boards and other programs as a whole; and one module reads the
# options for parts.
AT_WORK = (
    "capsule.bench.",
    "capsule.exporting.",
    "capsule.importing.",
    "capsule.parts.part_options",
)
SYSTEM = {"pathlib", "os", "shutil", "glob", "tempfile", "subprocess", "multiprocessing"}


def floor(module):
    """Return the number of a module's layer; scripts are the highest layer."""
    fitting = [name for name in FLOORS if f"{module}.".startswith(f"{name}.")]
    return FLOORS.index(max(fitting, key=len)) if fitting else len(FLOORS) - 1


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


@pytest.mark.parametrize("module", MODULES)
def test_no_module_imports_from_a_higher_floor(module):
    above = {other for other in imports_of(module) if floor(other) > floor(module)}
    assert above == set()


def test_no_imports_run_in_a_circle():
    try:
        tuple(TopologicalSorter({name: imports_of(name) for name in MODULES}).static_order())
    except CycleError as error:
        pytest.fail(" imports ".join(reversed(error.args[1])))


def test_a_circle_would_be_seen():
    with pytest.raises(CycleError):
        tuple(TopologicalSorter({"a": {"b"}, "b": {"a"}}).static_order())


LIBRARY = [name for name in MODULES if name.startswith("capsule.") and not name.startswith(AT_WORK)]


@pytest.mark.parametrize("module", LIBRARY)
def test_only_modules_that_say_so_in_their_name_know_files(module):
    if module.rpartition(".")[2] not in ON_FILES | ON_PROGRAMS:
        assert not SYSTEM & imported(MODULES[module])


def test_the_list_of_those_modules_names_none_without_need():
    names = {each.rpartition(".")[2] for each in LIBRARY if SYSTEM & imported(MODULES[each])}
    assert names == ON_FILES | ON_PROGRAMS


@pytest.mark.parametrize("module", [name for name in MODULES if "." in name])
def test_no_package_imports_snakemake(module):
    assert not {name for name in imported(MODULES[module]) if name.startswith("snakemake")}


@pytest.mark.parametrize("module", MODULES)
def test_no_module_is_long(module):
    lines = len(MODULES[module].read_text(encoding="utf-8").splitlines())
    if "." in module:
        assert lines <= 500
    else:
        assert lines <= (80 if module in FRONTS else 60)
