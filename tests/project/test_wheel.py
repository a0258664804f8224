"""The package works for a user of the library: from a wheel without this folder, and editable."""

import shutil
import sys
import zipfile
from pathlib import Path

import pytest

from support.command import output_of
from support.documents import all_blocks
from support.environments import WITHOUT_PATH, environment_with
from support.project import ROOT, Project

pytestmark = [pytest.mark.slow, pytest.mark.takes]

WITHOUT_INDEX = ["--no-deps", "--no-index"]
# Not this folder's code, and no Snakemake, even where it is installed.
ALONE = "import sys; sys.modules['snakemake'] = None\n"


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    folder = tmp_path_factory.mktemp("wheel")
    output_of(sys.executable, "-m", "build", "--wheel", "--no-isolation", "--outdir", folder, ROOT)
    (path,) = folder.glob("*.whl")
    return path


@pytest.fixture(scope="module")
def environment(wheel, tmp_path_factory):
    """Install the wheel."""
    folder = tmp_path_factory.mktemp("environment")
    return environment_with(folder, *WITHOUT_INDEX, wheel).parents[1]


def test_installed_editable_it_is_the_code_of_the_folder_and_nothing_is_copied(tmp_path):
    checkout = Project.create(tmp_path / "checkout").folder
    for name in ("pyproject.toml", "README.md"):
        shutil.copy2(ROOT / name, checkout)
    environment = tmp_path / "environment"
    environment_with(environment, *WITHOUT_INDEX, "--no-build-isolation", "-e", checkout)
    (packages,) = (environment / "lib").glob("python*/site-packages")
    assert not list(packages.rglob("*.smk"))
    (checkout / "workflow/scripts/capsule/added.py").write_text("WORD = 'changed'\n")
    program = "import capsule.added, importlib.util\nprint(capsule.added.WORD)\n"
    # No script of the workflow can be imported.
    program += "print(importlib.util.find_spec('draw'))\n"
    assert run(environment, program, tmp_path) == "changed\nNone\n"
    command = [environment / "bin" / "capsule", "--version"]
    assert (
        output_of(*command, cwd=tmp_path)
        == f"capsule 0.1.0, from {checkout / 'workflow/scripts/capsule'}\n"
    )


def run(environment, program, folder):
    """Run a program in the environment, and return its output."""
    call = [environment / "bin" / "python", "-W", "error", "-c", ALONE + program]
    return output_of(*call, cwd=folder, env=WITHOUT_PATH)


def tracked(*folders):
    """Return the files in some folders that git tracks."""
    output = output_of("git", "-C", ROOT, "ls-files", "-z", *folders)
    return {name for name in output.split("\0") if name and (ROOT / name).exists()}


def place(name):
    """Return the path of a project's file in the wheel."""
    package = "workflow/scripts/capsule/"
    if name.startswith(package):
        return name.removeprefix("workflow/scripts/")
    return f"capsule_project/{name}"


def test_the_wheel_holds_the_project_in_its_own_folders_and_the_library_once(wheel):
    left_out = tracked("workflow/studies", "workflow/firmware")
    project = tracked("config", "profiles", "workflow", "Snakefile") - left_out
    assert len(project) > 250 and len(left_out) > 39
    with zipfile.ZipFile(wheel) as archive:
        held = {name for name in archive.namelist() if ".dist-info/" not in name}
    assert {place(name) for name in project} <= held
    assert not {place(name) for name in left_out} & held
    assert not [
        name for name in held if name.startswith("capsule_project/workflow/scripts/capsule")
    ]


def test_the_wheel_asks_for_no_snakemake(wheel):
    with zipfile.ZipFile(wheel) as archive:
        (name,) = [each for each in archive.namelist() if each.endswith("/METADATA")]
        metadata = archive.read(name).decode()
    needed = [line for line in metadata.splitlines() if line.startswith("Requires-Dist: ")]
    assert any("numpy" in line for line in needed)
    assert all("extra == " in line for line in needed if "snakemake" in line)


def test_the_installed_command_makes_what_the_installed_library_judges(environment, tmp_path):
    """With the README's Python, the weights and the workflow that the wheel brings."""
    called = [environment / "bin" / "capsule", "simulate", "--sizes", "0", "3", "--runs", "7"]
    output_of(*called, cwd=tmp_path, env=WITHOUT_PATH)
    (block,) = [each for each in all_blocks() if each.document == "README.md" and each.is_python]
    program = f"""{block.text}
from capsule.engine import keys
from capsule.engine.project import PROJECT
from capsule.page import files
archive = capsule.load('raw')
verdicts = capsule.DetectorEstimator().fit(archive.X, archive.y).verdicts(archive.X)
print(sum(verdict.score == verdict.score for verdict in verdicts))
print(PROJECT)
print((PROJECT / 'Snakefile').is_file())
print(*keys.imported_files(PROJECT / 'workflow' / 'scripts' / 'fit.py'))
print(*files.code_checksums())
"""
    *_, judged, project, found, imported, named = run(environment, program, tmp_path).splitlines()
    (packages,) = (environment / "lib").glob("python*/site-packages")
    assert (judged, Path(project), found) == ("14", packages / "capsule_project", "True")
    assert str(packages / "capsule" / "method" / "particle.py") in imported.split()
    assert all(Path(each).is_relative_to(packages / "capsule") for each in imported.split())
    assert {"workflow/scripts/fit.py", "capsule/method/particle.py"} <= set(named.split())


def test_without_its_project_the_library_says_what_to_do(environment, tmp_path):
    # The library alone, as where somebody has copied its folder.
    (packages,) = (environment / "lib").glob("python*/site-packages")
    shutil.copytree(packages / "capsule", tmp_path / "alone" / "capsule")
    program = "import sys; sys.path.insert(0, 'alone'); import capsule\n"
    program += "try:\n    capsule.load('raw')\nexcept capsule.CapsuleError as error:\n"
    program += "    print(error)"
    told = run(environment, program, tmp_path)
    assert told.startswith(f"the folder {tmp_path / 'alone/capsule_project'} is missing beside ")
    assert told.endswith("install the project again, in its folder: pip install -e .\n")
