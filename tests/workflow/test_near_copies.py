"""A near copy of a recording changes no verdict on it, and the summary names it."""

import re

import numpy as np
import pytest

from capsule.recordings.recording import Recording, format_recording
from support.plain_figures import draw_plain_figures
from support.project import Project
from support.synthetic import make_recording

pytestmark = [pytest.mark.slow, pytest.mark.workflow]

NAMES = [f"{size}/r{run:02d}" for size in ("0mm", "3mm", "5mm") for run in range(1, 5)]
NAMES += ["unlabelled/other", "unlabelled/patient"]
DETECTORS = ["diagonal", "taught", "template"]
TABLES = ["results/evaluation/predictions.csv", "results/detections.csv"]


def verdicts(project, name, recording):
    """Return the numbers of every detector's verdict, without resubstitution."""
    rows = [row for row in project.table(name) if row["recording"] == recording]
    rows = [row for row in rows if row.get("scheme") != "resubstitution"]
    assert sorted(row["detector"] for row in rows) == DETECTORS
    texts = {"recording", "detector", "scheme", "no_verdict", "familiar", "unfamiliar_because"}
    return np.array(
        [[float(row[key] or "nan") for key in row.keys() - texts] for row in rows], dtype=float
    )


def put(project, name, values):
    """Write readings into an archive under a name."""
    path = project.raw / f"{name}.csv"
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(format_recording(Recording(np.arange(values.shape[1]) / 10, values, {})))


@pytest.fixture(scope="module")
def projects(tmp_path_factory):
    """Run an archive without and with near copies, of a labelled and an unlabelled recording."""
    folder = tmp_path_factory.mktemp("near")
    without = Project.create(folder / "without", NAMES, particles=20, iterations=20)
    draw_plain_figures(without.folder)
    run = without.snakemake(*TABLES)
    assert run.status == 0, run.output
    made = {"without": (without, run)}
    project = without.copy(folder / "with")
    one = make_recording(3.0, "3mm/r02").values
    put(project, "3mm/later", one[:, :-1] * 5.0 / 1024)
    put(project, "3mm/patient", make_recording(0.0, "unlabelled/patient").values[::-1, 2:])
    run = project.snakemake()
    assert run.status == 0, run.output
    made["with"] = project, run
    return made


@pytest.mark.parametrize(
    ("name", "recording"),
    [("evaluation/predictions.csv", "3mm/r02"), ("detections.csv", "unlabelled/patient")],
)
def test_a_verdict_is_taught_by_others_alone(projects, name, recording):
    (before, _), (after, _) = projects["without"], projects["with"]
    if recording == "unlabelled/patient":
        # What is nearly another labelled recording still teaches, so that one is compared there.
        put(before, "3mm/later", make_recording(3.0, "3mm/r02").values[:, :-1] * 5.0 / 1024)
        assert before.snakemake("results/detections.csv").status == 0
    else:
        put(before, "3mm/patient", make_recording(0.0, "unlabelled/patient").values[::-1, 2:])
        assert before.snakemake("results/evaluation/predictions.csv").status == 0
    ours, theirs = (verdicts(each, name, recording) for each in (before, after))
    np.testing.assert_allclose(ours, theirs, rtol=1e-6, atol=1e-9)
    (before.raw / "3mm/later.csv").unlink(missing_ok=True)
    (before.raw / "3mm/patient.csv").unlink(missing_ok=True)


def test_near_copies_are_named(projects):
    project, run = projects["with"]
    alike = {row["recording"]: row["near_copies"] for row in project.table("recordings.csv")}
    assert {name: others for name, others in alike.items() if others} == {
        "3mm/r02": "3mm/later",
        "3mm/later": "3mm/r02",
        "3mm/patient": "unlabelled/patient",
        "unlabelled/patient": "3mm/patient",
    }
    assert "  nearly the same as 3mm/later: raw/3mm/r02\n" in run.output
    page = (project.results / "report.html").read_text(encoding="utf-8")
    assert '<ul class="problems" id="near-copies-list">' in page
    # Each name leads to its drawing.
    assert '<code><a href="#recording=3mm/later">' in page
    assert "<code>3mm/later</code>, <code>3mm/r02</code>" in re.sub(r"</?a\b[^>]*>", "", page)
