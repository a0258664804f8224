"""The three places that name packages agree: pyproject.toml, the lock and environment.yml."""

import re
import tomllib

import pytest
import yaml
from packaging.requirements import Requirement

from capsule.detectors.registry import DETECTORS
from capsule.figures.registry import FIGURES
from edges.durations import RULES
from edges.sources import imported_files
from support.project import ROOT

PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
SCRIPTS = ROOT / "workflow" / "scripts"
LOCK = (ROOT / "requirements.lock").read_text(encoding="utf-8")
WANTED = [
    Requirement(text) for text in PROJECT["dependencies"] + PROJECT["optional-dependencies"]["test"]
]


def locked_versions():
    versions = {}
    for name, version in re.findall(r"^([a-z0-9._-]+)==([^ ;\\]+)", LOCK, re.MULTILINE):
        versions.setdefault(name, []).append(version)
    return versions


@pytest.mark.parametrize("requirement", WANTED, ids=lambda requirement: requirement.name)
def test_the_lock_pins_what_the_project_asks_for(requirement):
    versions = locked_versions()[requirement.name]
    assert all(requirement.specifier.contains(version) for version in versions)


def test_only_the_extra_for_parts_and_the_tests_ask_for_solids():
    (wanted,) = PROJECT["optional-dependencies"]["parts"]
    assert Requirement(wanted) in [each for each in WANTED if each.name == "manifold3d"]
    assert not [text for text in PROJECT["dependencies"] if text.startswith("manifold3d")]


def test_no_one_gets_open_cascade_without_asking():
    (wanted,) = [
        text
        for text in PROJECT["optional-dependencies"]["cad"]
        if not text.startswith("manifold3d")
    ]
    assert Requirement(wanted).name not in {each.name for each in WANTED} | locked_versions().keys()


def test_the_parts_import_open_cascade_only_when_they_are_asked_for_step_files():
    imports = {"OCP": r"^ *(from|import) OCP", "step_files": r"^(from|import) \S*step_files"}
    modules = {
        name: {
            path.name
            for path in SCRIPTS.rglob("*.py")
            if re.search(pattern, path.read_text(encoding="utf-8"), re.MULTILINE)
        }
        for name, pattern in imports.items()
    }
    # One module knows OCP, and none imports that module as it is itself imported.
    assert modules == {"OCP": {"step_files.py"}, "step_files": set()}


def test_no_step_of_the_workflow_imports_solids():
    modules = [row.module for row in [*FIGURES.values(), *DETECTORS.values()]]
    for rule in RULES:
        files = imported_files(SCRIPTS / f"{rule}.py", modules)
        assert files
        for path in files:
            text = path.read_text(encoding="utf-8")
            assert not re.search(r"(from|import) (manifold3d|OCP)", text), (rule, path)


def test_the_lock_holds_hashes_and_no_addresses():
    assert not re.search(r"https?:|--index-url|--find-links| @ ", LOCK)
    entries = re.split(r"\n(?=[a-z0-9])", LOCK)
    assert len(entries) > len(WANTED)
    assert all("--hash=sha256:" in entry for entry in entries)


def test_environment_yml_names_the_same_packages_and_ranges():
    environment = yaml.safe_load((ROOT / "environment.yml").read_text(encoding="utf-8"))
    conda = {(r.name, str(r.specifier)) for r in map(Requirement, environment["dependencies"])}
    pip = {(r.name, str(r.specifier)) for r in WANTED}
    assert conda == pip | {("python", PROJECT["requires-python"])}
