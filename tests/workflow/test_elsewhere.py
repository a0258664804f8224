"""The project works in other folders, for other users and workflows, and with other programs."""

import importlib.metadata
import os
import shutil
import subprocess
import sys

import pytest
import yaml

from support.command import output_of
from support.documents import blocks
from support.environments import WITHOUT_PATH, environment_with
from support.marks import needs_programs
from support.project import ROOT, Project
from support.synthetic import write_archive

pytestmark = [pytest.mark.slow, pytest.mark.workflow]

TABLES = ["results/evaluation/detection.csv", "results/detections.csv"]
TEMPLATES = "results/templates.npz"
RECORDINGS = [f"{size}mm/r{run:02d}" for size in (0, 3) for run in (1, 2)]
FIT = {"particles": 10, "iterations": 10}


# Folders.


@needs_programs("make", packages="make")
@pytest.mark.packages
@pytest.mark.takes(30)
def test_the_environment_works_in_a_path_with_spaces_and_of_more_than_250_characters(tmp_path):
    # The environment lies there, too: the first lines of its programs name it.
    parent = tmp_path / "a folder (of ours)" / ("long " * 25).strip() / ("longer " * 18).strip()
    project = Project.create(parent / "the project", RECORDINGS, samples=525, **FIT)
    assert len(str(project.folder)) > 250
    for name in ("Makefile", "pyproject.toml", "README.md", "requirements*.lock"):
        for path in ROOT.glob(name):
            shutil.copy2(path, project.folder)
    pinned = f"snakemake=={importlib.metadata.version('snakemake')}"
    environment_with(project.folder / ".venv", pinned, "--ignore-installed", "--no-deps")
    (project.folder / ".venv/ready").touch()
    settings = {"cwd": project.folder, "env": WITHOUT_PATH}
    output_of("make", "environment", **settings)
    output_of(".venv/bin/snakemake", "-c2", TEMPLATES, **settings)
    assert (project.folder / TEMPLATES).is_file()
    told = output_of(".venv/bin/capsule", "--version", **settings)
    assert str(project.folder / "workflow") in told
    # Nothing is copied.
    assert not list((project.folder / ".venv").rglob("*.smk"))


def test_a_folder_that_holds_recordings_alone_has_its_report_made_from_elsewhere(
    finished, tmp_path
):
    shutil.copytree(finished.raw, tmp_path / "raw")
    run = Project(tmp_path).snakemake(f"--snakefile={finished.folder / 'Snakefile'}", "-n")
    assert run.status == 0, run.output
    assert run.jobs["preprocess"] == 7


# What only tells.


def state_of(project):
    """Return when every result, recording and note of Snakemake was last changed, in ns."""
    folders = (project.results, project.raw, project.folder / ".snakemake/metadata")
    return {path: path.stat().st_mtime_ns for folder in folders for path in folder.rglob("*")}


def test_a_call_that_only_tells_changes_nothing(project):
    project.append("raw/2.5mm/r01.csv", "\n")
    project.append("results/fits/1mm/r01.json", "damage")
    (project.results / "fits/1mm/r02.json").unlink()
    project.configure(evaluation={"tolerance_mm": 2.0})
    before, beside = state_of(project), set(project.folder.iterdir())
    run = project.snakemake("--dry-run", "--config", "recordings_per_job=50", "--", *TABLES)
    assert run.status == 0, run.output
    assert state_of(project) == before
    assert set(project.folder.iterdir()) == beside


# Other workflows.


def shown_with(word):
    """Return the Snakefile in the manual that holds a word."""
    page = [each.text for each in blocks(ROOT / "docs/workflow.md")]
    return next(text for text in page if text.startswith("module") and word in text)


def test_two_instances_stand_side_by_side_with_settings_and_recordings_of_their_own(tmp_path):
    project = Project.create(tmp_path / "project", RECORDINGS, samples=525, **FIT)
    folder = tmp_path / "both"
    shutil.copytree(project.raw, folder / "first/raw")
    write_archive(folder / "second/raw", ["0mm/r01", "3mm/r01"], samples=525)
    shown = shown_with("module second").replace("path/to/project", str(project.folder))
    shown = shown.replace("results/report.html", TEMPLATES)
    (folder / "Snakefile").write_text(f'configfile: "settings.yaml"\n{shown}\n', encoding="utf-8")
    settings = {"first": {"fit": FIT}, "second": {"fit": FIT | {"particles": 12}}}
    (folder / "settings.yaml").write_text(yaml.safe_dump(settings), encoding="utf-8")
    caller = Project(folder)
    run = caller.snakemake()
    assert run.status == 0, run.output
    first, second = (folder / each / "results/fits/3mm" for each in ("first", "second"))
    assert (first / "r01.json").read_bytes() != (second / "r01.json").read_bytes()
    assert not (second / "r02.json").exists() and not (folder / "results").exists()
    write_archive(folder / "second/raw", ["2mm/r03"], samples=525)
    jobs = caller.snakemake("--dry-run").output
    assert "second_fit" in jobs
    assert "first_" not in jobs


def test_a_release_is_deployed_from_a_repository(tmp_path):
    """The workflow is as snakedeploy writes it; Snakemake already has a copy of the repository."""
    release = Project.create(tmp_path / "release").folder
    for part in ("pyproject.toml", ".git_archival.txt", ".gitattributes"):
        shutil.copy2(ROOT / part, release)
    git = ["git", "-c", "user.name=Test", "-c", "user.email=test@localhost", "-C", release]
    for step in (["init", "-q"], ["add", "."], ["commit", "-qm", "release"], ["tag", "v1"]):
        output_of(*git, *step)
    cache = tmp_path / "cache"
    kept = cache / "snakemake/snakemake/source-cache/snakemake-git-cache/github.com/laboratory"
    output_of("git", "clone", "-q", "--bare", release, kept / "capsule")

    folder = tmp_path / "lab"
    write_archive(folder / "raw", RECORDINGS, samples=525)
    shown = shown_with("github(").replace("OWNER/NAME", "laboratory/capsule")
    shown = shown.replace("VERSION", "v1").replace("config: config", "config: {}")
    (folder / "Snakefile").write_text(shown.format({"fit": {"particle": 3}}), encoding="utf-8")
    lab, called = Project(folder), {"environment": {"XDG_CACHE_HOME": os.fspath(cache)}}
    run = lab.snakemake("--dry-run", **called)
    assert run.status != 0
    assert "config of the module: fit.particle: there is no such key; did you mean" in run.output
    (folder / "Snakefile").write_text(shown.format({"fit": FIT}), encoding="utf-8")
    run = lab.snakemake(TEMPLATES, **called)
    assert run.status == 0, run.output
    assert run.jobs == {"preprocess": 4, "fit": 2, "list_labelled": 1, "templates": 1}
    # The page reads the version from these files.
    unpacked = lab.folder / ".snakemake/capsule" / output_of(*git, "rev-parse", "HEAD").strip()
    assert (unpacked / ".git_archival.txt").is_file()


@pytest.mark.packages
@pytest.mark.takes(20)
def test_the_newest_snakemake_and_that_of_the_lock_agree_on_what_is_to_be_done(tmp_path):
    environment_with(tmp_path / "newest", "--upgrade", "snakemake<10")
    (packages,) = (tmp_path / "newest/lib").glob("python*/site-packages")
    newest = {"PYTHONPATH": str(packages), "PYTHONWARNINGS": "default"}
    project = Project.create(tmp_path / "project", RECORDINGS[::2], samples=525, **FIT)
    run = project.snakemake(TEMPLATES, environment=newest)
    assert run.status == 0, run.output
    # Each reads the notes of the other.
    assert project.snakemake(TEMPLATES).did_nothing


# Other users.


@pytest.mark.skipif(
    os.name != "posix" or os.geteuid() != 0 or not shutil.which("setpriv"),
    reason="only the administrator can give files to another user",
)
def test_another_user_goes_on_where_it_may_write_and_elsewhere_is_told_so_and_may_judge(project):
    # Root may open anything, unless it gives that right away.
    user = ["setpriv", "--bounding-set=-dac_override,-dac_read_search,-fowner", sys.executable]

    def call(*words):
        to = {"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT, "text": True}
        done = subprocess.run([*user, *words], cwd=project.folder, check=False, **to)
        return done.returncode, done.stdout

    def give_away(rights):
        for each in (project.folder, *project.folder.rglob("*")):
            os.chown(each, 12345, 12345)
        subprocess.run(["chmod", "-R", rights, project.folder], check=True)

    path = project.raw / "0mm/r01.csv"
    path.write_text(f"# note: changed\n{path.read_text()}")
    give_away("a+rwX")
    status, told = call("-m", "snakemake", "-c1", "results/recordings.csv")
    assert status == 0, told
    give_away("go=rX")
    # The folder itself may be open to all.
    project.folder.chmod(0o777)
    status, told = call("-m", "snakemake", "-n", "results/recordings.csv")
    assert status != 0
    assert f"{project.folder}/.snakemake cannot be written" in told
    assert "Traceback" not in told
    capsule = "workflow/scripts/capsule"
    assert call(capsule, "judge", "raw/1mm/r01.csv")[0] == 0
    assert "run.lock: Permission denied" in call(capsule, "forget", "1mm/r01", "--yes")[1]
    assert (project.raw / "1mm/r01.csv").exists()
