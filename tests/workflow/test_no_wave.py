"""Without a wave on every sensor there is no verdict, and nothing is learned."""

import numpy as np
import pytest

from capsule.recordings.recording import Recording, format_recording
from support.plain_figures import draw_plain_figures
from support.project import Project

pytestmark = [pytest.mark.slow, pytest.mark.workflow]

NAMES = [f"{size}/r{run:02d}" for size in ("0mm", "3mm") for run in range(1, 5)]
NAMES += ["unlabelled/patient"]
TABLES = ["results/evaluation/predictions.csv", "results/detections.csv", "results/templates.json"]
NOISE = ["0mm/noise", "3mm/noise", "unlabelled/noise"]


@pytest.fixture(scope="module")
def projects(tmp_path_factory):
    """Run an archive without and with recordings of noise, and return both projects."""
    folder = tmp_path_factory.mktemp("noise")
    without = Project.create(folder / "without", NAMES, particles=20, iterations=20)
    draw_plain_figures(without.folder)
    run = without.snakemake(*TABLES)
    assert run.status == 0, run.output
    project = without.copy(folder / "with")
    numbers = np.random.default_rng(3)
    for name in NOISE:
        values = numbers.normal(500, 20, (4, 500)).round()
        recording = Recording(np.arange(500) / 10, values, {"adc_bits": "10"})
        (project.raw / f"{name}.csv").write_bytes(format_recording(recording))
    run = project.snakemake()
    assert run.status == 0, run.output
    return without, project


@pytest.mark.parametrize("name", ["evaluation/predictions.csv", "detections.csv"])
def test_no_detector_judges_noise_and_each_says_why(projects, name):
    rows = [row for row in projects[1].table(name) if row["recording"] in NOISE]
    assert {row["detector"] for row in rows} == {"template", "diagonal", "taught"}
    for row in rows:
        judged = {key: value for key, value in row.items() if value}
        assert judged.keys() <= {"recording", "detector", "scheme", "size_mm", "no_verdict"}
        assert row["no_verdict"].startswith("no wave on sensor_")


@pytest.mark.parametrize("name", [*TABLES, "results/detectors.json"])
def test_noise_changes_nothing_for_the_others(projects, name):
    texts = [(project.folder / name).read_text(encoding="utf-8") for project in projects]
    lines = [
        [line for line in text.splitlines() if not line.startswith(tuple(NOISE))] for text in texts
    ]
    assert lines[0] == lines[1]


def test_the_list_of_recordings_says_why_too(projects):
    rows = {row["recording"]: row for row in projects[1].table("recordings.csv")}
    for name, row in rows.items():
        assert row["status"] == "accepted"
        assert bool(row["no_verdict"]) == (name in NOISE)
