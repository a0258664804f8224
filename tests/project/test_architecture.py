"""The code has the structure that the documentation describes: layers, sizes and names."""

import ast
from collections import Counter
from functools import cache
from graphlib import CycleError, TopologicalSorter

import pytest

from support.project import ROOT

SCRIPTS = ROOT / "workflow" / "scripts"
MODULES = {
    ".".join(path.relative_to(SCRIPTS).with_suffix("").parts): path
    for path in sorted(SCRIPTS.rglob("*.py"))
    if path.name != "__init__.py"
}
# Layers from the lowest to the highest; the longest name that fits gives a module's layer.
FLOORS = (
    "capsule",
    "capsule.geometry",
    "capsule.phantom",
    "capsule.parts",
    "capsule.detectors",
    "capsule.survey",
    "capsule.evaluation",
    "capsule.interface",
    "capsule.figures",
    "capsule.page",
    "capsule.importing",
    "edges",
    "importing",
    "phantom_study",
    "scorer_teaching",
    "part_making",
    "exporting",
    "acquisition",
    "scripts",
)
FRONTS = {"acquire", "simulate", "study_phantom", "survey", "teach_scorer"}
FRONTS |= {"capsule_command", "demo", "judge_file", "shell_completion"}
# Several folders have a module of this name.
SAME_SUBJECT = {"registry"}


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


@pytest.mark.parametrize("module", [name for name in MODULES if name.startswith("capsule.")])
def test_the_library_knows_no_path_and_no_snakemake(module):
    assert not {"pathlib", "os", "snakemake", "glob", "shutil"} & imported(MODULES[module])


@pytest.mark.parametrize("module", MODULES)
def test_no_module_is_long(module):
    lines = len(MODULES[module].read_text(encoding="utf-8").splitlines())
    if "." in module:
        assert lines <= 300
    else:
        assert lines <= (80 if module in FRONTS else 60)


def test_no_two_modules_share_a_name():
    names = Counter(module.rpartition(".")[2] for module in MODULES)
    assert {name for name, count in names.items() if count > 1} <= SAME_SUBJECT
