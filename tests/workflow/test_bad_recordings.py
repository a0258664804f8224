"""What cannot be used is refused with its reason, and costs the rest nothing.

`bad_recordings.py` holds the cases.
"""

import csv
import json
import os
import re
import subprocess
import sys

import numpy as np
import pytest
import yaml

from capsule.detectors.described import read_features
from capsule.recordings.names import as_cell
from capsule.store import files
from capsule.store.results import Results
from support.bad_recordings import HARMLESS, HOSTILE, PASSED_OVER, REJECTED
from support.packed import inflated
from support.project import ROOT, Project
from support.same_recordings import results_of_all

pytestmark = [
    pytest.mark.workflow,
    pytest.mark.skipif(
        sys.platform != "linux", reason="only Linux lets a file have every name that is tried here"
    ),
]

TABLES = ["results/evaluation/detection.csv", "results/detections.csv"]
GOOD = ["0mm/r01", "0mm/r02", "unlabelled/patient"]
GOOD += [f"3mm/r{run:02d}" for run in range(1, 6)]

FOLDERS = {name.partition("/")[0] for name in GOOD}
# A process for each of a hundred bad files would tell nothing new.
TOGETHER = 200


def create(folder):
    """Make a project with the good recordings alone."""
    project = Project.create(folder, GOOD, samples=525, particles=10, iterations=10)
    project.configure(recordings_per_job=TOGETHER)
    return project


@pytest.fixture(scope="module")
def good(tmp_path_factory):
    """Run the workflow with only the good recordings, and return the project."""
    project = create(tmp_path_factory.mktemp("good") / "project")
    drawn = [f"results/plot_data/{label}/batch.json" for label in FOLDERS]
    run = project.snakemake(*TABLES, *drawn)
    assert run.status == 0, run.output
    return project


@pytest.fixture(scope="module")
def mixed(tmp_path_factory):
    """Run the workflow with harmless variants of the good recordings beside every bad file."""
    # The folder of the project has a strange name, too.
    project = create(tmp_path_factory.mktemp("mixed") / "it's $(touch pwned) & é")
    for case in REJECTED + PASSED_OVER:
        path = os.fsencode(project.raw) + b"/" + os.fsencode(case.name)
        os.makedirs(os.path.dirname(path), exist_ok=True)  # noqa: PTH103, PTH120
        case.make(type(project.raw)(os.fsdecode(path)))
    for name, (_, disguise) in zip(GOOD, HARMLESS, strict=False):
        path = project.raw / f"{name}.csv"
        path.write_bytes(disguise(path.read_bytes()))
    run = project.snakemake()
    assert run.status == 0, run.output
    return project, run


def test_a_bad_recording_is_one_row_with_its_reason_and_a_line_on_the_terminal(mixed):
    project, run = mixed
    rows = project.table("recordings.csv")
    rejected = {row["recording"]: row["reason"] for row in rows if row["status"] == "rejected"}
    assert rejected == {case.listed_as: case.reason for case in REJECTED}
    assert len(rows) == len(GOOD) + len(REJECTED)
    for name, reason in rejected.items():
        assert f"  rejected: raw/{name}: {reason}\n" in run.output
    assert f"{len(GOOD)} recordings accepted, {len(REJECTED)} rejected." in run.output


def test_what_is_no_recording_is_named(mixed):
    project, run = mixed
    rows = {row["path"].rstrip("/"): row for row in project.table("passed_over.csv")}
    assert {name: row["reason"] for name, row in rows.items()} == {
        as_cell(os.fsdecode(case.name)): case.reason for case in PASSED_OVER
    }
    for row in rows.values():
        assert f"  passed over: raw/{row['path']}: {row['reason']}\n" in run.output


def described(project, kind, suffix, read):
    """Return what the rule describe has written on the good recordings."""
    found = {}
    for label in FOLDERS:
        found |= read(project.results / kind / label / f"batch{suffix}")
    return {name: found[name] for name in GOOD}


def signals_drawn(project):
    """Return what the report draws of the good recordings, without the facts on their files."""
    drawn = {
        name: json.loads(inflated(each["drawn"]))
        for name, each in described(project, "plot_data", ".json", files.read_json).items()
    }
    for each in drawn.values():
        del each["facts"]
    return drawn


def test_the_others_results_are_the_same_to_the_bit(mixed, good):
    project, _ = mixed
    before, after = good.result_bytes(), project.result_bytes()
    compared = list(results_of_all(good))
    assert {"templates.npz", "detections.csv", "evaluation/sizing.csv"} <= set(compared)
    assert [name for name in compared if after[name] != before[name]] == []
    ours, theirs = (
        Results.of_table(each.results, each.results / "recordings.csv") for each in (project, good)
    )
    for name in GOOD:
        np.testing.assert_array_equal(ours.signal(name), theirs.signal(name))
        np.testing.assert_array_equal(ours.matrix(name), theirs.matrix(name))
    for label in FOLDERS:
        places = project.table(f"best_places/{label}/batch.csv")
        found = [row for row in places if row["recording"] in GOOD]
        assert found == good.table(f"best_places/{label}/batch.csv")
    kept = [row for row in project.table("recordings.csv") if row["status"] == "accepted"]
    for row, other in zip(kept, good.table("recordings.csv"), strict=True):
        for column in ("recording", "size_mm", "samples", "duration_s", "reason"):
            assert row[column] == other[column]
    scored, alone = (described(each, "features", ".npz", read_features) for each in (project, good))
    for name in GOOD:
        np.testing.assert_equal(vars(scored[name]), vars(alone[name]))
    assert signals_drawn(project) == signals_drawn(good)
    for row in project.table("recordings.csv"):
        if row["status"] == "rejected" and row["batch"] and "same content" not in row["reason"]:
            assert np.isnan(ours.matrix(row["recording"])).all()


def test_no_name_ran_as_a_command(mixed):
    project, _ = mixed
    found = [*project.folder.rglob("*pwned"), *project.folder.parent.glob("*pwned")]
    assert [path for path in found if path.parent != project.raw / "3mm"] == []


def test_no_text_of_a_recording_reaches_a_page_as_html(mixed):
    project, _ = mixed
    pages = [*project.results.rglob("*.html"), *project.results.rglob("*.svg")]
    for page in pages:
        text = page.read_text(encoding="utf-8")
        assert HOSTILE not in text
        assert "<img src=x" not in text
        assert "<b>3mm" not in text


def test_no_header_is_a_formula_in_a_spreadsheet(mixed):
    project, _ = mixed
    sources = [row["source"] for row in project.table("recordings.csv")]
    assert f" ={HOSTILE} formula of the tests" in sources
    assert not any(source.startswith("=") for source in sources)


def test_no_cell_of_any_table_is_a_formula(mixed):
    project, _ = mixed
    cells = [
        cell
        for path in project.results.rglob("*.csv")
        for row in csv.reader(path.read_text(encoding="utf-8").splitlines())
        for cell in row
    ]
    assert " =1+1.csv" in cells
    assert " \uff1d1+1.csv" in cells
    starts = [cell for cell in cells if cell.startswith(("=", "+", "-", "@", "\uff1d"))]
    assert [cell for cell in starts if not re.fullmatch(r"-[0-9.]+(e-?[0-9]+)?", cell)] == []


@pytest.mark.slow
def test_on_request_the_run_stops_before_any_fit_and_names_them_all(mixed):
    project, _ = mixed
    assert project.snakemake().did_nothing
    run = project.snakemake("--config", "on_rejected=fail")
    assert run.status != 0
    assert not run.jobs["fit"]
    for case in REJECTED:
        assert f"\n  {case.listed_as}: {case.reason}\n" in run.output
    assert "set on_rejected: report in config/config.yaml" in run.output


TELL_MEMORY = """
import resource, subprocess, sys
subprocess.run(sys.argv[1:], check=True)
print(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss)
"""


@pytest.mark.skipif(os.name == "nt", reason="Windows has no such measure")
def test_a_gigabyte_is_rejected_in_little_memory(tmp_path):
    recording = tmp_path / "3mm/huge.csv"
    recording.parent.mkdir()
    with recording.open("wb") as stream:
        stream.truncate(1_000_000_000)
    config = yaml.safe_load((ROOT / "config/config.yaml").read_text(encoding="utf-8"))
    settings = {name: config[name] for name in ("recording", "preprocessing")}
    command = [sys.executable, str(ROOT / "workflow/scripts/preprocess.py"), "3mm/huge"]
    command += ["--contents", f"{recording}=too large", "--batch", "3mm/huge"]
    command += ["--settings", json.dumps(settings)]
    command += ["--signals", str(tmp_path / "s.npy"), "--matrices", str(tmp_path / "m.npy")]
    command += ["--checks", str(tmp_path / "c.json")]
    # From a small process: what a large one starts counts that one's memory as its own.
    told = subprocess.run(
        [sys.executable, "-c", TELL_MEMORY, *command], check=True, capture_output=True, text=True
    )
    assert "larger than 16 MB" in (tmp_path / "c.json").read_text(encoding="utf-8")
    largest_kilobytes = int(told.stdout.splitlines()[-1])
    assert largest_kilobytes < 500_000


@pytest.mark.slow
def test_without_any_usable_nodule_the_run_says_so(tmp_path):
    project = Project.create(tmp_path / "project", ["0mm/r01", "unlabelled/patient"], samples=525)
    (project.raw / "3mm").mkdir()
    (project.raw / "3mm/bad.csv").touch()
    run = project.snakemake()
    assert run.status != 0
    assert "error: no recording of a nodule can be used" in run.output
    assert "  rejected: raw/3mm/bad: the file is empty" in run.output
    assert "Traceback" not in run.output


@pytest.mark.parametrize(
    ("mine", "arguments", "told"),
    [
        (
            "fit: {particles: many}\n",
            ["--configfile", "mine.yaml", "--config", "on_rejected=stop"],
            "--configfile: on_rejected: 'stop' is not allowed; must be one of report, fail",
        ),
        (None, ["--config", "fit={sed: 3}"], ": fit.sed: there is no such key; did you mean"),
        ("fit: {seed: 3}\nfit: {particles: 5}\n", [], "line 2: the key 'fit' appears twice"),
    ],
    ids=["a file beside", "a word of the command", "the file itself"],
)
def test_a_mistake_in_the_configuration_is_told_before_anything_runs(
    tmp_path, mine, arguments, told
):
    project = Project.create(tmp_path / "project", ["3mm/r01"], samples=525)
    if mine:
        file = "mine.yaml" if arguments else "config/config.yaml"
        (project.folder / file).write_text(mine, encoding="utf-8")
    run = project.snakemake(*arguments)
    assert run.status != 0
    assert told in run.output
    assert "Traceback" not in run.output
    assert not project.results.exists()


def test_a_folder_that_snakemake_cannot_work_in_is_refused(tmp_path):
    run = Project.create(tmp_path / "{x}").snakemake()
    assert run.status != 0
    assert (
        "rename this folder; Snakemake cannot work in a folder whose name holds { or }"
        in run.output
    )
    assert "Traceback" not in run.output
