"""The places that name packages agree: pyproject.toml, locks, environments, vendored files."""

import importlib.metadata
import importlib.util
import json
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
from packaging.utils import canonicalize_name

import capsule
from capsule.engine import project
from capsule.engine.project import how_to_install
from support.command import output_of
from support.documents import text_of
from support.project import ROOT

PROJECT = tomllib.loads(text_of("pyproject.toml"))["project"]
EXTRAS = PROJECT["optional-dependencies"]
INSTALLED = {each.name.lower(): each for each in importlib.metadata.distributions()}
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


RUNNING = ("workflow", "formats", "learn", "notebook")
WANTED = dict(zip(LOCKS, (wanted("workflow"), wanted(*RUNNING), wanted("dev")), strict=True))
WANTED["requirements-pip.lock"] = [Requirement("pip")]
WANTED["requirements-slurm.lock"] = list(map(Requirement, EXTRAS["slurm"]))


def named(requirements, *left_out):
    """Return name and range of each package."""
    return {(r.name, str(r.specifier)) for r in requirements if r.name not in left_out}


def locked_versions(lock):
    versions = {}
    pinned = r"^([a-z0-9._-]+)(?:\[[a-z0-9,_-]+\])?==([^ ;\\]+)"
    for name, version in re.findall(pinned, text_of(lock), re.MULTILINE):
        versions.setdefault(name, []).append(version)
    return versions


@pytest.mark.parametrize("lock", WANTED)
def test_the_lock_pins_what_the_project_asks_for_by_hashes_and_no_addresses(lock):
    pinned = locked_versions(lock)
    for requirement in WANTED[lock]:
        versions = pinned[requirement.name.lower()]
        assert all(requirement.specifier.contains(version) for version in versions), requirement
    text = text_of(lock)
    assert not re.search(r"https?:|--index-url|--find-links| @ ", text)
    assert all("--hash=sha256:" in entry for entry in re.split(r"\n(?=[a-z0-9])", text))
    known = {canonicalize_name(name) for each in (lock, LOCKS[0]) for name in locked_versions(each)}
    # It names what its packages need, since pip does not ask, and the extras that they ask for in
    # one another. Without these, pip 23 takes a newer release than the pinned one, and stops at it.
    for name in pinned.keys() & INSTALLED.keys():
        for requirement in map(Requirement, INSTALLED[name].requires or []):
            if requirement.marker is None or requirement.marker.evaluate({"extra": ""}):
                assert canonicalize_name(requirement.name) in known, (name, requirement)
                for extra in requirement.extras:
                    asked = rf"^{re.escape(f'{requirement.name.lower()}[{extra}]')}=="
                    assert re.search(asked, text, re.M), (name, requirement)


def test_all_locks_pin_the_same_and_that_of_make_report_nothing_that_only_an_extra_asks_for():
    *smaller, tests = map(locked_versions, LOCKS)
    assert all(pinned.items() <= tests.items() for pinned in smaller)
    needed = {each.name.lower() for each in wanted("workflow")}
    optional = {each.name.lower() for each in wanted(*EXTRAS.keys() - {"test", "dev"})} - needed
    locked = locked_versions("requirements.lock").keys()
    assert len(optional) > 10
    assert not optional & locked
    # Snakemake's own report.
    packages = importlib.metadata.packages_distributions()
    for path in Path(importlib.util.find_spec("snakemake").origin).parent.glob("report/**/*.py"):
        for module in re.findall(r"^ *(?:import|from) (\w+)", text_of(path), re.MULTILINE):
            assert {name.lower() for name in packages.get(module, ())} <= locked
    # No one gets Open CASCADE without asking.
    (kernel,) = [text for text in EXTRAS["cad"] if not text.startswith("manifold3d")]
    assert Requirement(kernel).name not in locked_versions("requirements-test.lock")


def test_environment_yml_names_the_same_packages_and_ranges():
    conda, steps = (
        named(map(Requirement, yaml.safe_load(text_of(name))["dependencies"]))
        for name in ("environment.yml", "workflow/environment.yml")
    )
    pip = {(name.lower(), versions) for name, versions in named(wanted(*RUNNING))}
    python = ("python", str(SpecifierSet(PROJECT["requires-python"])))
    assert conda == pip | {python, ("pip", "")}
    # The steps alone, for `--sdm conda`: no boards, no installation.
    assert steps == {python} | named(wanted("workflow"), "pyserial", "hatchling", "editables")
    # conda-forge and bioconda lack these.
    extra = {Requirement(text).name for text in EXTRAS["parts"] + EXTRAS["lsl"]}
    assert extra == {"manifold3d", "pylsl"}


def test_the_version_stands_in_pyproject_and_what_cites_it_agrees():
    newest = re.search(r"^## \[(.+?)\]", text_of("CHANGELOG.md"), re.MULTILINE)[1]
    told = {newest, yaml.safe_load(text_of("CITATION.cff"))["version"], capsule.__version__}
    assert told == {PROJECT["version"]}


def test_every_error_that_names_an_extra_names_one_that_there_is(monkeypatch, tmp_path):
    texts = list(map(text_of, (ROOT / "workflow/scripts/capsule").rglob("*.py")))
    # The functions that tell an extra.
    pattern = r"(?:how_to_install\(|not_installed\(.+, )[\"'](\w+)[\"']\)"
    hinted = {extra for text in texts for extra in re.findall(pattern, text)}
    assert {"workflow", "formats", "learn", "lsl", "parts", "cad"} == hinted <= EXTRAS.keys()
    # No release of this name can be downloaded, and an installed copy is in no folder of its own.
    assert not [text for text in texts if "origami-capsule[" in text]
    assert how_to_install("learn") == f'in {ROOT}: pip install -e ".[learn]"'
    monkeypatch.setattr(project, "PROJECT", tmp_path)
    assert how_to_install("learn") == 'pip install "scikit-learn>=1.6"'


# As where somebody has copied the folder of the library alone.
def test_without_its_project_the_library_says_what_to_do(monkeypatch, tmp_path):
    monkeypatch.setattr(project, "CONFIG", tmp_path / "config")
    with pytest.raises(capsule.CapsuleError, match=r"is missing beside .*; install the p"):
        capsule.load(ROOT / "raw")


def install(folder, *what):
    """Have uv install wheels into a folder, from pip's index; pip takes more processor time."""
    pip = [sys.executable, "-m", "pip", "config", "get", "global.index-url"]
    index = subprocess.run(pip, capture_output=True, text=True, check=False).stdout.strip()
    environment = os.environ | ({"UV_DEFAULT_INDEX": index} if index else {})
    uv = Path(sys.executable).with_name("uv"), "pip", "install", "--only-binary", ":all:"
    output_of(*uv, "--target", folder, *what, env=environment)


PLATFORMS = {11: "x86_64-unknown-linux-gnu", 12: "aarch64-apple-darwin"}
PLATFORMS |= {13: "x86_64-pc-windows-msvc"}


@pytest.mark.packages
@pytest.mark.takes
@pytest.mark.parametrize("version", PLATFORMS)
def test_the_lock_can_be_installed_on_every_system_and_python(version, tmp_path):
    system = "--python-platform", PLATFORMS[version], "--python-version", f"3.{version}"
    # Only connection-pool has no wheel.
    lock = "--no-binary", "connection-pool", "--requirement", ROOT / "requirements-test.lock"
    install(tmp_path, "--dry-run", *system, "--require-hashes", *lock)


def test_the_files_from_elsewhere_are_what_the_lock_pins():
    vendored = {"uplot": "workflow/report/vendor/uplot/uPlot.iife.min.js"}
    vendored["axe-core"] = "tests/vendor/axe-core/axe.min.js"
    lock = text_of("workflow/report/vendor/package-lock.json")
    for package, file in vendored.items():
        pinned = json.loads(lock)["packages"][f"node_modules/{package}"]["version"]
        assert re.search(r"v\d+\.\d+\.\d+", text_of(file)[:200])[0] == f"v{pinned}"
        assert (ROOT / file).with_name("LICENSE").stat().st_size > 500
    assert '"resolved"' not in lock


@pytest.mark.packages
def test_the_oldest_numpy_gives_the_numbers_of_the_literal_formulas(tmp_path):
    (numpy,) = (each for each in wanted() if each.name == "numpy")
    (oldest,) = (each.version for each in numpy.specifier if each.operator == ">=")
    # The first one that was built for this Python may be newer.
    oldest = {(3, 13): "2.1.0"}.get(sys.version_info[:2], f"{oldest}.0")
    install(tmp_path, "--no-deps", f"numpy=={oldest}")
    program = "import numpy, pytest; print(numpy.__version__); pytest.main()"
    tests = ["tests/capsule/method", "tests/capsule/recordings/test_acceptance.py"]
    call = [sys.executable, "-c", program, "-q", "-n0", "-p", "no:cacheprovider", *tests]
    told = output_of(*call, cwd=ROOT, env=os.environ | {"PYTHONPATH": str(tmp_path)})
    assert told.startswith(f"{oldest}\n")
    assert re.search(r"^\d{3,} passed in", told, re.MULTILINE), told
