"""Every extension of docs/workflow.md works in a copy of the project."""

import subprocess
import sys

import numpy as np
import pytest

from support.extending import PAGE, changes
from support.project import ROOT, Project

pytestmark = pytest.mark.slow

RECORDINGS = [f"{size}mm/r{run:02d}" for size in (0, 1, 3) for run in (1, 2)]


@pytest.fixture(scope="module")
def extended(tmp_path_factory):
    """Run a project with a new detector, figure and header line, and return it."""
    folder = tmp_path_factory.mktemp("extended") / "project"
    project = Project.create(
        folder, [*RECORDINGS, "unlabelled/patient"], particles=20, iterations=20
    )
    (folder / "config/config.yaml").write_bytes((ROOT / "config/config.yaml").read_bytes())
    for title in ("A new detector", "A new figure", "A new header line, as a column"):
        for change in changes(title):
            change.apply(folder)
    project.configure(fit={"particles": 20, "iterations": 20})
    named = project.raw / "3mm/r01.csv"
    named.write_text("# operator: Ann\n" + named.read_text(encoding="utf-8"), encoding="utf-8")
    run = project.snakemake()
    assert run.status == 0, run.output
    return project


@pytest.mark.workflow
def test_a_new_detector_goes_from_its_module_to_the_report(extended):
    for name in ("evaluation/predictions.csv", "evaluation/summary.csv", "detections.csv"):
        rows = [row for row in extended.table(name) if row["detector"] == "loudest"]
        assert rows, name
    page = (extended.results / "report.html").read_text(encoding="utf-8")
    assert "the highest envelope against a threshold" in page
    assert "there is no such key" not in page


@pytest.mark.workflow
def test_the_recorder_judges_by_a_new_detector_too(extended):
    code = """
import sys
from pathlib import Path
import numpy as np
from capsule.judging.verdict import FinalVerdict
from capsule.engine.configuration import read_config_file
final = FinalVerdict(
    Path("results/templates.npz"), Path("results/detectors.json"),
    read_config_file(Path("config/config.yaml")),
)
print(*final.judge(np.load("results/signals/unlabelled/patient.npy")), sep="\\n")
"""
    ended = subprocess.run(
        [sys.executable, "-c", code],
        cwd=extended.folder,
        env={"PYTHONPATH": str(extended.folder / "workflow/scripts")},
        capture_output=True,
        text=True,
        check=True,
    )
    (row,) = [row for row in extended.table("detections.csv") if row["detector"] == "loudest"]
    (line,) = [line for line in ended.stdout.splitlines() if "loudest" in line]
    assert line.startswith(f"verdict of loudest: {row['verdict']}")


@pytest.mark.workflow
def test_a_new_figure_is_drawn_and_stands_on_the_page(extended):
    assert len(extended.table("figures/scores.csv")) == len(RECORDINGS)
    page = (extended.results / "report.html").read_text(encoding="utf-8")
    assert 'id="figure-scores"' in page


@pytest.mark.workflow
def test_a_new_header_line_becomes_a_column(extended):
    operators = {row["recording"]: row["operator"] for row in extended.table("recordings.csv")}
    assert operators["3mm/r01"] == "Ann"
    assert set(operators.values()) == {"", "Ann"}


def simulate(folder, *options):
    """Call capsule simulate of a copy of the project."""
    command = [sys.executable, "workflow/scripts/capsule", "simulate", *options]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)


@pytest.mark.workflow
def test_five_sensors_go_from_the_simulator_to_the_report(tmp_path):
    project = Project.create(tmp_path / "project")
    (project.folder / "config/config.yaml").write_bytes((ROOT / "config/config.yaml").read_bytes())
    for change in changes("A fifth sensor"):
        change.apply(project.folder)
    project.configure(fit={"particles": 20, "iterations": 20})
    ended = simulate(project.folder, "--runs", "2", "--sizes", "0", "3")
    assert ended.returncode == 0, ended.stderr
    run = project.snakemake()
    assert run.status == 0, run.output
    assert {row["status"] for row in project.table("recordings.csv")} == {"accepted"}
    with np.load(project.results / "templates.npz") as templates:
        assert templates["3mm"].shape == (5, 1250)
    assert (project.results / "report.html").exists()


def test_a_new_bench_makes_other_recordings(tmp_path):
    project = Project.create(tmp_path / "project")
    for change in changes("A new bench for the phantom"):
        change.apply(project.folder)
    options = ("--runs", "1", "--sizes", "4", "--out")
    assert simulate(project.folder, *options, "usual").returncode == 0
    ended = simulate(project.folder, "--bench", "firm-wall", *options, "other")
    assert ended.returncode == 0, ended.stderr
    usual, other = (project.folder / out / "4mm/r01.csv" for out in ("usual", "other"))
    assert usual.read_bytes() != other.read_bytes()


def test_extensions_touch_few_files():
    most = {
        "A new detector": 5,
        "A new figure": 3,
        "A new header line, as a column": 1,
        "A fifth sensor": 1,
        "A new bench for the phantom": 1,
    }
    for title, count in most.items():
        assert 1 <= len({change.file for change in changes(title)}) <= count, title
    section = (
        PAGE.read_text(encoding="utf-8").partition("\n## Extending\n")[2].partition("\n## ")[0]
    )
    assert 40 < len(section.splitlines()) <= 60
