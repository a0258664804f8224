"""Another workflow can use this one as a module."""

import os
import shutil
import subprocess

import pytest
import yaml

from support.plain_figures import draw_plain_figures
from support.project import PARTS, ROOT, Project
from support.synthetic import write_archive

pytestmark = [pytest.mark.slow, pytest.mark.workflow]

FIRST = [f"{size}mm/r{run:02d}" for size in (0, 3) for run in (1, 2, 3)]
SECOND = [f"{size}mm/r{run:02d}" for size in (0, 2) for run in (1, 2)]
FIT = {"particles": 10, "iterations": 10}
TABLES = ["results/evaluation/detection.csv", "results/detections.csv"]

SIDE_BY_SIDE = """
configfile: "settings.yaml"

module first:
    snakefile: "{project}/workflow/Snakefile"
    prefix: "first"
    config: config["first"]

use rule * from first as first_*

module second:
    snakefile: "{project}/workflow/Snakefile"
    prefix: "second"
    config: config["second"]

use rule * from second as second_*

rule both:
    default_target: True
    input:
        "first/results/report.html",
        expand("second/{{table}}", table={tables}),
"""
DEPLOYED = """
module capsule:
    snakefile: github("laboratory/capsule", path="workflow/Snakefile", tag="v1")
    config: {{"fit": {fit}}}

use rule * from capsule
"""


@pytest.fixture(scope="module")
def alone(tmp_path_factory):
    """Make the tables of the first archive without another workflow, and return the project."""
    folder = tmp_path_factory.mktemp("alone") / "project"
    project = Project.create(folder, FIRST, samples=400, **FIT)
    draw_plain_figures(folder)
    run = project.snakemake(*TABLES)
    assert run.status == 0, run.output
    return project


def test_two_instances_stand_side_by_side_with_settings_and_recordings_of_their_own(
    alone, tmp_path
):
    (tmp_path / "Snakefile").write_text(
        SIDE_BY_SIDE.format(project=alone.folder, tables=TABLES), encoding="utf-8"
    )
    settings = {"first": {"fit": FIT}, "second": {"fit": FIT | {"particles": 12}}}
    (tmp_path / "settings.yaml").write_text(yaml.safe_dump(settings), encoding="utf-8")
    for name, recordings in (("first", FIRST), ("second", SECOND)):
        (tmp_path / name / "raw").mkdir(parents=True)
        write_archive(tmp_path / name / "raw", recordings, samples=400)
    caller = Project(tmp_path)
    run = caller.snakemake()
    assert run.status == 0, run.output
    first, second = Project(tmp_path / "first"), Project(tmp_path / "second")
    made, expected = first.result_bytes(), alone.result_bytes()
    assert {name: made[name] for name in expected} == expected
    assert made["report.html"].rstrip().endswith(b"</html>")
    assert len(second.table("recordings.csv")) == len(SECOND)
    assert {path.name for path in tmp_path.iterdir()} >= {"first", "second"}
    assert not (tmp_path / "results").exists()
    assert caller.snakemake().did_nothing
    write_archive(second.raw, ["2mm/r03"], samples=400)
    jobs = caller.snakemake("--dry-run").output
    assert "second_fit" in jobs
    assert "first_" not in jobs


def test_a_setting_that_does_not_exist_is_refused_by_name(alone, tmp_path):
    text = DEPLOYED.replace('github("laboratory/capsule", path=', "").replace(', tag="v1")', "")
    text = text.replace('"workflow/Snakefile"', f'"{alone.folder}/workflow/Snakefile"')
    (tmp_path / "Snakefile").write_text(text.format(fit={"particle": 3}), encoding="utf-8")
    shutil.copytree(alone.raw, tmp_path / "raw")
    run = Project(tmp_path).snakemake("--dry-run")
    assert run.status != 0
    assert "config of the module: fit.particle: there is no such key; did you mean" in run.output


def test_a_release_is_deployed_from_a_repository_and_makes_the_report(tmp_path):
    """The workflow is as snakedeploy writes it; Snakemake already has a copy of the repository."""
    release = tmp_path / "release"
    release.mkdir()
    for part in [*PARTS, "pyproject.toml", ".git_archival.txt", ".gitattributes"]:
        copy = shutil.copytree if (ROOT / part).is_dir() else shutil.copy2
        copy(ROOT / part, release / part)
    draw_plain_figures(release)
    git = ["git", "-c", "user.name=Test", "-c", "user.email=test@localhost", "-C", release]
    for step in (["init", "-q"], ["add", "."], ["commit", "-qm", "release"], ["tag", "v1"]):
        subprocess.run([*git, *step], check=True)
    commit = subprocess.run([*git, "rev-parse", "HEAD"], check=True, capture_output=True, text=True)
    cache = tmp_path / "cache"
    kept = cache / "snakemake/snakemake/source-cache/snakemake-git-cache/github.com/laboratory"
    kept.mkdir(parents=True)
    clone = ["git", "clone", "-q", "--bare", release, kept / "capsule"]
    subprocess.run(clone, check=True)

    folder = tmp_path / "lab"
    (folder / "raw").mkdir(parents=True)
    write_archive(folder / "raw", FIRST, samples=400)
    (folder / "Snakefile").write_text(DEPLOYED.format(fit=FIT), encoding="utf-8")
    lab = Project(folder)
    run = lab.snakemake(environment={"XDG_CACHE_HOME": os.fspath(cache)})
    assert run.status == 0, run.output
    assert len(lab.table("recordings.csv")) == len(FIRST)
    page = (lab.results / "report.html").read_text(encoding="utf-8")
    assert commit.stdout.strip()[:7] in page


def test_a_folder_that_holds_recordings_alone_has_its_report_made_from_elsewhere(alone, tmp_path):
    shutil.copytree(alone.raw, tmp_path / "raw")
    snakefile = f"--snakefile={alone.folder / 'Snakefile'}"
    by_folder = Project(alone.folder).snakemake(f"--directory={tmp_path}", "--dry-run")
    by_snakefile = Project(tmp_path).snakemake(snakefile, "--dry-run")
    for run in (by_folder, by_snakefile):
        assert run.status == 0, run.output
        assert run.jobs["preprocess"] == len(FIRST)
