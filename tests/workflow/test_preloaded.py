"""Jobs as forks of one process do what jobs do that start their own Python."""

import pytest

from support.marks import needs_forks
from support.project import Project

pytestmark = [
    pytest.mark.workflow,
    pytest.mark.slow(8),
    needs_forks,
]

RECORDINGS = ["0mm/r01", "2mm/r01", "3mm/r01", "3mm/r02", "unlabelled/patient"]


@pytest.fixture(scope="module")
def new(tmp_path_factory):
    """Return a project with recordings and without results."""
    folder = tmp_path_factory.mktemp("new") / "project"
    return Project.create(folder, RECORDINGS, samples=400, particles=10, iterations=10)


def test_the_results_are_the_same_to_the_bit(new, tmp_path):
    forks, alone = new.copy(tmp_path / "forks"), new.copy(tmp_path / "alone")
    temporary = tmp_path / "temporary"
    temporary.mkdir()
    runs = [
        forks.snakemake("results/sites.csv", environment={"TMPDIR": str(temporary)}),
        alone.snakemake("results/sites.csv", environment={"CAPSULE_PRELOAD": "0"}),
    ]
    assert [run.status for run in runs] == [0, 0], runs[0].output
    assert forks.result_bytes() == alone.result_bytes()
    assert list(temporary.iterdir()) == []


def test_a_failing_job_prints_its_error_once_and_in_its_log(new, tmp_path):
    project = new.copy(tmp_path / "project")
    project.append("workflow/scripts/average.py", "\nraise SystemExit('error: no average')\n")
    run = project.snakemake("results/templates.json", environment={})
    assert run.status == 1
    log = (project.results / "logs/average.log").read_text(encoding="utf-8")
    assert log.splitlines()[-1] == "error: no average"
