"""Healthy recordings from another source than the nodules' are warned of on top of the report."""

import re

import pytest

from support.plain_figures import draw_plain_figures
from support.project import Project

pytestmark = [pytest.mark.slow, pytest.mark.workflow]

# As many as it takes for a size to be reliably found.
NAMES = [f"{size}mm/r{run:02d}" for size in (0, 3) for run in range(1, 21)] + ["unlabelled/patient"]
SAID = "whether there is a nodule follows from the source"


@pytest.fixture(scope="module")
def reports(tmp_path_factory):
    """Run an archive of one source, then with another source of the healthy recordings."""
    folder = tmp_path_factory.mktemp("confounded") / "project"
    project = Project.create(folder, NAMES, particles=20, iterations=20)
    project.configure(recordings_per_job=100)
    draw_plain_figures(project.folder)
    made = []
    for source in ("formula of the tests", "finger on fabric"):
        for path in project.raw.glob("0mm/*.csv"):
            text = path.read_text(encoding="utf-8")
            path.write_text(re.sub("(?m)^# source: .*$", f"# source: {source}", text), "utf-8")
        run = project.snakemake()
        assert run.status == 0, run.output
        page = (project.results / "report.html").read_text(encoding="utf-8")
        made.append((run.output, page))
    return made


def test_recordings_of_one_source_are_not_warned_of(reports):
    output, page = reports[0]
    assert "  confounded:" not in output
    assert 'id="confounded"' not in page
    assert "Nodules reliably found" in page and "3 mm and larger" in page


def test_another_source_of_the_healthy_recordings_is_told_on_top_and_on_the_terminal(reports):
    output, page = reports[1]
    assert f"  confounded: among the recordings that teach, {SAID}\n" in output
    head = page[page.index("<header>") : page.index("</header>")]
    rows = [re.findall(r"<t[hd]\b[^>]*>(.*?)</t[hd]>", row) for row in head.split("<tr>")[1:]]
    assert rows == [
        ["Header", "Value", "no nodule", "3 mm"],
        ["source", "finger on fabric", "20", "0"],
        ["formula of the tests", "0", "20"],
    ]
    assert f"Among the recordings that teach, {SAID}." in head


def test_no_detector_is_called_reliable_then(reports):
    main = reports[1][1].partition("<main>")[2]
    shown = main[: main.index('id="made"')]
    assert "reliab" not in shown.casefold()
    assert shown.count('<p class="answer">not shown</p>') == 4
    assert f"cannot show how far to trust a verdict: among those that teach, {SAID}." in shown
