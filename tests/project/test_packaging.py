"""The places that name packages agree: pyproject.toml, the two locks and environment.yml."""

import importlib.metadata
import importlib.util
import os
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
import yaml
from packaging.requirements import Requirement
from packaging.specifiers import SpecifierSet

import capsule
from capsule.detectors.registry import DETECTORS
from capsule.engine import project
from capsule.engine.keys import imported_files
from capsule.engine.project import how_to_install
from capsule.figures.registry import FIGURES
from capsule.page.files import RULE_SCRIPTS
from support.project import ROOT

PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
SCRIPTS = ROOT / "workflow" / "scripts"
EXTRAS = PROJECT["optional-dependencies"]
# The packages that give each module.
DISTRIBUTIONS = importlib.metadata.packages_distributions()
# What `make report` installs, and what `make formats` and `make test` add to it.
LOCKS = ("requirements.lock", "requirements-formats.lock", "requirements-test.lock")


def wanted(*extras):
    """Return the packages of extras, with the project's dependencies and other extras."""
    requirements = list(map(Requirement, PROJECT["dependencies"]))
    for text in (text for extra in extras for text in EXTRAS[extra]):
        requirement = Requirement(text)
        own = requirement.name == PROJECT["name"]
        requirements += wanted(*sorted(requirement.extras)) if own else [requirement]
    return requirements


# As the recipes of conda-forge and bioconda have it.
NOT_ON_CONDA = {"manifold3d", "pylsl"}
RUNNING = ("workflow", "formats", "learn", "notebook")
WANTED = dict(zip(LOCKS, (wanted("workflow"), wanted(*RUNNING), wanted("dev")), strict=True))


def locked_versions(lock):
    versions = {}
    text = (ROOT / lock).read_text(encoding="utf-8")
    pinned = r"^([a-z0-9._-]+)(?:\[[a-z0-9,_-]+\])?==([^ ;\\]+)"
    for name, version in re.findall(pinned, text, re.MULTILINE):
        versions.setdefault(name, []).append(version)
    return versions


@pytest.mark.parametrize("lock", LOCKS)
def test_the_lock_pins_what_the_project_asks_for(lock):
    pinned = locked_versions(lock)
    for requirement in WANTED[lock]:
        versions = pinned[requirement.name.lower()]
        assert all(requirement.specifier.contains(version) for version in versions), requirement


@pytest.mark.parametrize(
    ("lock", "some"), [*zip(LOCKS, (set(), set(), {"coverage[toml]"}), strict=True)]
)
def test_the_lock_names_the_extras_that_its_packages_ask_for_in_one_another(lock, some):
    # Without them, pip 23 takes a newer release than the pinned one, and stops at it.
    text = (ROOT / lock).read_text(encoding="utf-8")
    asked = {
        f"{requirement.name.lower()}[{extra}]"
        for name in locked_versions(lock)
        if (distribution := installed(name))
        for requirement in map(Requirement, distribution.requires or [])
        if requirement.marker is None or requirement.marker.evaluate({"extra": ""})
        for extra in requirement.extras
    }
    assert some <= asked
    assert {each for each in asked if not re.search(rf"^{re.escape(each)}==", text, re.M)} == set()


def installed(name):
    """Return what is known of an installed package; None if this system does not need it."""
    try:
        return importlib.metadata.distribution(name)
    except importlib.metadata.PackageNotFoundError:
        return None


def test_all_locks_pin_the_same_versions():
    *smaller, tests = map(locked_versions, LOCKS)
    for needed in smaller:
        assert needed == {name: tests[name] for name in needed}


def test_make_report_installs_nothing_that_only_an_extra_asks_for():
    optional = {
        Requirement(text).name.lower()
        for name in EXTRAS.keys() - {"workflow", "test", "dev"}
        for text in EXTRAS[name]
    }
    assert len(optional) > 10
    assert not optional & locked_versions("requirements.lock").keys()


def test_snakemakes_own_report_needs_no_more_than_make_report_installs():
    folder = Path(importlib.util.find_spec("snakemake").origin).parent / "report"
    text = "\n".join(path.read_text(encoding="utf-8") for path in folder.rglob("*.py"))
    imported = re.findall(r"^ *(?:import|from) (\w+)", text, re.MULTILINE)
    needed = {name.lower() for module in imported for name in DISTRIBUTIONS.get(module, ())}
    assert {"pygments", "snakemake"} <= needed
    assert needed <= locked_versions("requirements.lock").keys()


def test_no_one_gets_open_cascade_without_asking():
    (kernel,) = [text for text in EXTRAS["cad"] if not text.startswith("manifold3d")]
    lock = "requirements-test.lock"
    asked = {each.name for each in WANTED[lock]} | locked_versions(lock).keys()
    assert Requirement(kernel).name not in asked


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


def test_no_step_of_the_workflow_imports_solids_or_what_is_made_for_programs():
    modules = [row.module for row in [*FIGURES.values(), *DETECTORS.values()]]
    for rule in RULE_SCRIPTS:
        files = imported_files(SCRIPTS / f"{rule}.py", modules)
        names = {path.relative_to(SCRIPTS).as_posix() for path in files}
        assert "capsule/__init__.py" in names
        assert not {name for name in names if name.startswith("capsule/interface/")}, rule
        for path in files:
            text = path.read_text(encoding="utf-8")
            assert not re.search(r"(from|import) (manifold3d|OCP)", text), (rule, path)


@pytest.mark.parametrize("lock", LOCKS)
def test_the_lock_holds_hashes_and_no_addresses(lock):
    text = (ROOT / lock).read_text(encoding="utf-8")
    assert not re.search(r"https?:|--index-url|--find-links| @ ", text)
    entries = re.split(r"\n(?=[a-z0-9])", text)
    assert len(entries) > len(WANTED[lock])
    assert all("--hash=sha256:" in entry for entry in entries)


def test_environment_yml_names_the_same_packages_and_ranges():
    environment = yaml.safe_load((ROOT / "environment.yml").read_text(encoding="utf-8"))
    conda = {(r.name, str(r.specifier)) for r in map(Requirement, environment["dependencies"])}
    pip = {(r.name.lower(), str(r.specifier)) for r in wanted(*RUNNING)}
    python = ("python", str(SpecifierSet(PROJECT["requires-python"])))
    assert conda == pip | {python, ("pip", "")}
    # The steps alone, for `--sdm conda`: no boards, no installation.
    steps = yaml.safe_load((ROOT / "workflow/environment.yml").read_text(encoding="utf-8"))
    asked = {(r.name, str(r.specifier)) for r in map(Requirement, steps["dependencies"])}
    others = {"pyserial", "hatchling", "editables"}
    assert asked == {python} | {
        (r.name, str(r.specifier)) for r in wanted("workflow") if r.name not in others
    }
    assert {Requirement(text).name for text in EXTRAS["parts"] + EXTRAS["lsl"]} == NOT_ON_CONDA


def test_the_version_stands_in_pyproject_and_what_cites_it_agrees():
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    changes = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    assert citation["version"] == PROJECT["version"] == capsule.__version__
    assert re.search(r"^## \[(.+?)\]", changes, re.MULTILINE)[1] == PROJECT["version"]


def hinted_extras():
    """Return the extras that an error of the package names, by the functions that tell them."""
    pattern = r"(?:how_to_install\(|not_installed\(.+, )[\"'](\w+)[\"']\)"
    return {
        extra
        for path in (SCRIPTS / "capsule").rglob("*.py")
        for extra in re.findall(pattern, path.read_text(encoding="utf-8"))
    }


def test_every_error_that_names_an_extra_names_one_that_there_is():
    assert {"workflow", "formats", "learn", "lsl", "parts", "cad"} == hinted_extras()
    assert hinted_extras() <= EXTRAS.keys()
    texts = [path.read_text(encoding="utf-8") for path in (SCRIPTS / "capsule").rglob("*.py")]
    # No release of this name can be downloaded.
    assert not [text for text in texts if "origami-capsule[" in text]


def test_an_installed_copy_names_no_folder_in_which_the_line_would_fail(monkeypatch, tmp_path):
    assert how_to_install("learn") == f'in {ROOT}: pip install -e ".[learn]"'
    monkeypatch.setattr(project, "PROJECT", tmp_path)
    assert how_to_install("learn") == 'pip install "scikit-learn>=1.6"'


@pytest.mark.packages
@pytest.mark.takes
@pytest.mark.parametrize(
    ("platform", "version"),
    [
        ("x86_64-unknown-linux-gnu", "3.11"),
        ("aarch64-apple-darwin", "3.12"),
        ("x86_64-pc-windows-msvc", "3.13"),
    ],
)
def test_the_lock_can_be_installed_on_every_system_and_python(platform, version, tmp_path):
    resolved = dry_install("requirements-test.lock", platform, version, tmp_path)
    assert resolved.returncode == 0, resolved.stderr


def dry_install(lock, platform, version, folder):
    """Resolve a lock for another system with wheels; only connection-pool has no wheel."""
    index = subprocess.run(
        [sys.executable, "-m", "pip", "config", "get", "global.index-url"],
        capture_output=True,
        text=True,
        check=False,
    ).stdout.strip()
    options = ["--python-platform", platform, "--python-version", version, "--target", folder]
    options += ["--only-binary", ":all:", "--no-binary", "connection-pool", "--require-hashes"]
    options += ["--requirement", ROOT / lock]
    return subprocess.run(
        [Path(sys.executable).with_name("uv"), "pip", "install", "--dry-run", *options],
        env={**os.environ, **({"UV_DEFAULT_INDEX": index} if index else {})},
        capture_output=True,
        text=True,
        check=False,
    )
