"""What cannot be used is refused with its reason, and costs the rest nothing.

`bad_recordings.py` holds the cases.
"""

import csv
import os
import re
import sys

import numpy as np
import pytest

from capsule.recordings.names import as_cell
from capsule.store.results import Results
from support.bad_recordings import HARMLESS, HOSTILE, PASSED_OVER, REJECTED

pytestmark = [
    pytest.mark.workflow,
    pytest.mark.slow,
    pytest.mark.skipif(
        sys.platform != "linux", reason="only Linux lets a file have every name that is tried here"
    ),
]

GOOD = [f"0mm/r{run:02d}" for run in (1, 2, 3, 4)]
GOOD += ["1mm/r01", "1mm/r02", "2.5mm/r01", "2.5mm/r02", "unlabelled/patient"]
# Results that hold all recordings; the others have a file for each batch, which the lists name.
OF_ALL = ("evaluation/", "figures/", "templates", "detections.csv", "detectors.json", "sites.csv")


@pytest.fixture(scope="module")
def mixed(finished, tmp_path_factory):
    """Run the workflow with harmless variants of the good recordings beside every bad file.

    Its jobs take many recordings each, and those of the finished project one.
    """
    # The folder of the project has a strange name, too.
    folder = tmp_path_factory.mktemp("mixed") / "it's $(touch pwned) & é"
    project = finished.copy(folder, results=False)
    project.configure(recordings_per_job=20)
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


def test_the_others_results_are_the_same_to_the_bit(mixed, finished):
    project, _ = mixed
    before, after = finished.result_bytes(), project.result_bytes()
    of_all = [name for name in before if name.startswith(OF_ALL)]
    assert {"templates.npz", "detections.csv", "evaluation/sizing.csv"} <= set(of_all)
    assert [name for name in of_all if after[name] != before[name]] == []
    ours, theirs = (
        Results.of_table(each.results, each.results / "recordings.csv")
        for each in (project, finished)
    )
    for name in GOOD:
        np.testing.assert_array_equal(ours.signal(name), theirs.signal(name))
        np.testing.assert_array_equal(ours.matrix(name), theirs.matrix(name))
    nodules = [name for name in GOOD if not name.startswith(("0mm", "unlabelled"))]
    assert ours.fits(nodules) == theirs.fits(nodules)
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


def test_on_request_the_run_stops_before_any_fit_and_names_them_all(mixed):
    project, _ = mixed
    run = project.snakemake("--config", "on_rejected=fail")
    assert run.status != 0
    assert not run.jobs["fit"]
    for case in REJECTED:
        assert f"\n  {case.listed_as}: {case.reason}\n" in run.output
    assert "set on_rejected: report in config/config.yaml" in run.output


def test_without_any_usable_nodule_the_run_says_so(new):
    for path in new.raw.glob("*mm/*.csv"):
        path.write_bytes(b"")
    run = new.snakemake("results/templates.npz")
    assert run.status != 0
    assert "error: no recording of a nodule can be used" in run.output
    assert "  rejected: raw/1mm/r01: the file is empty" in run.output
    assert "Traceback" not in run.output
