"""The package works for a user of the library, from a wheel without this folder."""

import sys
import zipfile
from pathlib import Path

import pytest

from support.command import output_of
from support.documents import all_blocks
from support.environments import WITHOUT_PATH, environment_with
from support.project import ROOT

pytestmark = [pytest.mark.slow, pytest.mark.takes]


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    folder = tmp_path_factory.mktemp("wheel")
    output_of(sys.executable, "-m", "build", "--wheel", "--no-isolation", "--outdir", folder, ROOT)
    (path,) = folder.glob("*.whl")
    return path


def tracked(*folders):
    """Return the files in some folders that git tracks."""
    output = output_of("git", "-C", ROOT, "ls-files", "-z", *folders)
    return {name for name in output.split("\0") if name and (ROOT / name).exists()}


def test_the_wheel_holds_the_project_the_library_once_and_asks_for_no_snakemake(wheel):
    library = tracked("workflow/scripts/capsule")
    left_out = tracked("workflow/studies", "workflow/firmware")
    project = tracked("config", "profiles", "workflow", "Snakefile") - left_out - library
    assert min(len(library), len(project), len(left_out)) > 39
    expected = {name.removeprefix("workflow/scripts/") for name in library}
    expected |= {f"capsule_project/{name}" for name in project}
    with zipfile.ZipFile(wheel) as archive:
        held = {name for name in archive.namelist() if ".dist-info/" not in name}
        (metadata,) = [name for name in archive.namelist() if name.endswith("/METADATA")]
        needed = archive.read(metadata).decode().splitlines()
    assert held == expected
    needed = [line for line in needed if line.startswith("Requires-Dist: ")]
    assert any("numpy" in line for line in needed)
    assert all("extra == " in line for line in needed if "snakemake" in line)


def test_the_installed_command_makes_what_the_installed_library_judges(wheel, tmp_path):
    """With the README's Python, the weights and the workflow that the wheel brings."""
    # Not this folder's code, and no Snakemake, even where it is installed.
    python = environment_with(tmp_path / "environment", "--no-deps", "--no-index", wheel)
    there = {"cwd": tmp_path, "env": WITHOUT_PATH}
    called = [python.with_name("capsule"), "simulate", "--sizes", "0", "3", "--runs", "7"]
    output_of(*called, **there)
    (block,) = [each for each in all_blocks() if each.document == "README.md" and each.is_python]
    program = f"""import sys; sys.modules['snakemake'] = None
{block.text}
from capsule.engine import keys
from capsule.engine.project import PROJECT
from capsule.page import files
archive = capsule.load('raw')
verdicts = capsule.DetectorEstimator().fit(archive.X, archive.y).verdicts(archive.X)
print(sum(verdict.score == verdict.score for verdict in verdicts))
print(PROJECT)
print(*keys.imported_files(PROJECT / 'workflow' / 'scripts' / 'fit.py'))
print(*files.code_checksums())
"""
    printed = output_of(python, "-W", "error", "-c", program, **there).splitlines()
    *_, judged, project, imported, named = printed
    (packages,) = (python.parents[1] / "lib").glob("python*/site-packages")
    assert (judged, Path(project)) == ("14", packages / "capsule_project")
    assert str(packages / "capsule" / "method" / "particle.py") in imported.split()
    assert all(Path(each).is_relative_to(packages / "capsule") for each in imported.split())
    assert {"workflow/scripts/fit.py", "capsule/method/particle.py"} <= set(named.split())
