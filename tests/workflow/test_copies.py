"""A copy of a recording under another name changes no number, wherever it comes in the order."""

import csv

import pytest

from capsule.recordings.recording import Recording, format_recording
from support.project import Project
from support.synthetic import make_recording

pytestmark = [pytest.mark.slow, pytest.mark.workflow]

# Two runs over each place, of which every first one is copied.
SITES = {
    f"{folder}/r{run}": f"{folder} {(run + 1) // 2}"
    for folder in ("0mm", "3mm", "unlabelled")
    for run in range(1, 5)
}
# Shorter names, which count instead of the originals, and sort before or behind all others.
RENAMED = {"0mm/r1": "0mm/z", "0mm/r3": "0mm/a", "3mm/r1": "3mm/z", "3mm/r3": "3mm/a"}
RENAMED["unlabelled/r1"] = "unlabelled/z"
TARGETS = ["results/sites.csv", "results/evaluation/auc.csv", "results/templates.npz"]


def write(project, name):
    folder = name.partition("/")[0]
    size_mm = 4.0 if folder == "unlabelled" else float(folder.removesuffix("mm"))
    made = make_recording(size_mm, name)
    header = {**made.header, "site": SITES[name], "nodule_at_mm": "20.5"}
    path = project.raw / f"{name}.csv"
    path.parent.mkdir(exist_ok=True)
    path.write_bytes(format_recording(Recording(made.time_s, made.values, header)))


@pytest.fixture(scope="module")
def projects(tmp_path_factory):
    """Run the workflow without and with the copies, and return both projects."""
    folder = tmp_path_factory.mktemp("copies")
    before = Project.create(folder / "before", particles=20, iterations=20)
    for name in SITES:
        write(before, name)
    run = before.snakemake(*TARGETS)
    assert run.status == 0, run.output
    after = before.copy(folder / "after")
    for name, copy in RENAMED.items():
        content = (after.raw / f"{name}.csv").read_bytes()
        (after.raw / f"{copy}.csv").write_bytes(content)
    run = after.snakemake(*TARGETS)
    assert run.status == 0, run.output
    assert run.jobs["fit"] == 2
    return before, after


def table(path):
    """Return the sorted rows of a table; names of copies are replaced by those of the originals."""
    originals = {copy: name for name, copy in RENAMED.items()}
    with path.open(encoding="utf-8", newline="") as stream:
        rows = list(csv.DictReader(stream))
    for row in rows:
        if "recording" in row:
            row["recording"] = originals.get(row["recording"], row["recording"])
    return sorted(rows, key=lambda row: list(row.values()))


def test_the_copies_count_and_the_originals_do_not(projects):
    status = {row["recording"]: row["status"] for row in projects[1].table("recordings.csv")}
    assert {status[name] for name in RENAMED} == {"rejected"}
    assert {status[copy] for copy in RENAMED.values()} == {"accepted"}


def test_every_table_is_the_same_to_the_bit_but_for_names(projects):
    before, after = (project.results for project in projects)
    paths = [path.relative_to(before) for path in sorted(before.glob("evaluation/*.csv"))]
    assert len(paths) > 12
    for path in [*paths, "detections.csv", "sites.csv"]:
        assert table(before / path) == table(after / path), path
    # Tables without names are the same as they stand.
    for path in [path for path in paths if "predictions" not in path.name]:
        assert (before / path).read_bytes() == (after / path).read_bytes(), path


def test_templates_and_what_the_detectors_learn_are_the_same_to_the_bit(projects):
    before, after = (project.results for project in projects)
    for name in ("templates.json", "templates.npz", "detectors.json"):
        assert (before / name).read_bytes() == (after / name).read_bytes(), name


def test_a_fit_goes_by_the_readings(projects):
    before, after = (project.results / "fits" for project in projects)
    for name, copy in RENAMED.items():
        if name.startswith("3mm"):
            one, other = (before / f"{name}.json").read_text(), (after / f"{copy}.json").read_text()
            assert one.replace(name, copy) == other


def test_tables_stand_in_the_order_of_names(projects):
    for project in projects:
        with (project.results / "evaluation/predictions.csv").open(encoding="utf-8") as stream:
            rows = list(csv.DictReader(stream))
        names = list(dict.fromkeys(row["recording"] for row in rows))
        assert names == sorted(names)
        detectors = [row["detector"] for row in rows]
        assert detectors == sorted(detectors, key=list(dict.fromkeys(detectors)).index)
