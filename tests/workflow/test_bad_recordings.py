"""What cannot be used is refused with its reason, and costs the rest nothing.

Each reason is tested where it is written: tests/capsule/recordings and tests/capsule/store. Here
stands one file of each kind, which all lie in one archive.
"""

import csv
import os
import re
import shutil
import sys
from pathlib import Path

import numpy as np
import pytest

from capsule.recordings.names import as_cell, displayed
from capsule.recordings.recording import Recording, format_recording
from capsule.store.results import Results
from support.synthetic import make_recording

pytestmark = [
    pytest.mark.workflow,
    pytest.mark.slow,
    pytest.mark.skipif(sys.platform != "linux", reason="only Linux lets a file have such names"),
]

# Results that hold all recordings; the others have a file for each batch, which the lists name.
OF_ALL = ("evaluation/", "figures/", "templates", "detections.csv", "detectors.json", "sites.csv")
HOSTILE = "<script>alert(1)</script>"
BEFORE_THE_SOURCE = f"# {HOSTILE}: x\n# source: ={HOSTILE} ".encode()


def content(name, **changes):
    """Return the bytes of a good recording, another one for each name, or of a changed one."""
    made = make_recording(3.0, f"bad/{name}", samples=600)
    return format_recording(Recording(**vars(made) | changes))


# The bytes of each file, or what makes it; a part of its reason.
UNUSABLE = {
    "3mm/empty.csv": (b"", "the file is empty"),
    "3mm/html.csv": (f"time_s,{HOSTILE}\n0,1\n".encode(), f"found: 'time_s,{HOSTILE}'"),
    "3mm/huge.csv": (
        lambda path: os.truncate(os.open(path, os.O_CREAT | os.O_WRONLY), 1_000_000_000),
        "larger than 16 MB",
    ),
    "1mm/a-copy-of-r01.csv": (
        lambda path: path.write_bytes(b"# by: me\n" + path.with_name("r01.csv").read_bytes()),
        "the same content as 1mm/r01",
    ),
    "3mm/pipe.csv": (os.mkfifo, "a pipe or a device, not a file"),
    "3mm/link-out.csv": (lambda path: path.symlink_to("/etc/passwd"), "a link to a place outside"),
    "3mm/$(touch pwned).csv": (content("command"), "rename the file"),
    "3mm/`touch pwned`;touch pwned;'.csv": (content("commands"), "rename the file"),
    "3mm/{recording}.csv": (content("wildcard"), "rename the file"),
    "3mm/line\nbreak.csv": (content("line"), "rename the file"),
    '3mm/"><img src=x onerror=alert(1)>.csv': (content("html name"), "rename the file"),
    "3mm/\udcff.csv": (content("bytes"), "rename the file"),
}
PASSED_OVER = {
    "3mm/notes.txt": (b"moved the sensor", "not a .csv file"),
    "3mm/r07.csv.part": (content("part"), "an unfinished recording"),
    "=1+1.csv": (content("formula"), "directly in raw/"),
    "\uff1d1+1.csv": (content("full-width formula"), "directly in raw/"),
    "7mm": (lambda path: path.symlink_to("/etc"), "a link to a place outside raw/"),
    "$(touch pwned)mm": (Path.mkdir, "a folder whose name is not a size"),
    "<b>3mm": (Path.mkdir, "a folder whose name is not a size"),
}
# Good recordings that look other than usual.
HARMLESS = {
    "0mm/r01": lambda data: b"\xef\xbb\xbf" + data.replace(b"\n", b"\r\n"),
    "0mm/r02": lambda data: data.replace(b"# source: ", BEFORE_THE_SOURCE),
    "1mm/r01": lambda data: data[data.index(b"time_s") :],
}


def listed_as(path):
    """Return the name of a file in the list of recordings."""
    by_name = UNUSABLE[path][1].startswith(("rename", "a pipe", "a link"))
    return displayed(path) if by_name else path.removesuffix(".csv")


@pytest.fixture(scope="module")
def mixed(finished, tmp_path_factory):
    """Run the workflow with harmless variants of the good recordings beside every bad file.

    Its jobs take many recordings each, and those of the finished project one.
    """
    # The folder of the project has a strange name, too.
    folder = tmp_path_factory.mktemp("mixed") / "it's $(touch pwned) & é"
    project = finished.copy(folder, results=False)
    shutil.rmtree(project.folder / "sessions")
    project.configure(recordings_per_job=20)
    for name, (made, _) in (UNUSABLE | PASSED_OVER).items():
        path = project.raw / name
        path.parent.mkdir(exist_ok=True)
        path.write_bytes(made) if isinstance(made, bytes) else made(path)
    for name, disguise in HARMLESS.items():
        path = project.raw / f"{name}.csv"
        path.write_bytes(disguise(path.read_bytes()))
    run = project.snakemake()
    assert run.status == 0, run.output
    return project, run


def test_what_cannot_be_used_is_a_row_with_its_reason_and_a_line_on_the_terminal(mixed, finished):
    project, run = mixed
    rows = project.table("recordings.csv")
    rejected = {row["recording"]: row["reason"] for row in rows if row["status"] == "rejected"}
    assert rejected.keys() == set(map(listed_as, UNUSABLE))
    good = len(rows) - len(UNUSABLE)
    assert good == len(finished.table("recordings.csv"))
    assert f"{good} recordings accepted, {len(UNUSABLE)} rejected." in run.output
    for path, (_, reason) in UNUSABLE.items():
        told = rejected[listed_as(path)]
        assert reason in told
        assert f"  rejected: raw/{listed_as(path)}: {told}\n" in run.output
    rows = {row["path"].rstrip("/"): row for row in project.table("passed_over.csv")}
    assert rows.keys() == set(map(as_cell, PASSED_OVER))
    for path, (_, reason) in PASSED_OVER.items():
        row = rows[as_cell(path)]
        assert reason in row["reason"]
        assert f"  passed over: raw/{row['path']}: {row['reason']}\n" in run.output


def test_the_others_results_are_the_same_to_the_bit(mixed, finished):
    project, _ = mixed
    before, after = finished.result_bytes(), project.result_bytes()
    of_all = [name for name in before if name.startswith(OF_ALL)]
    assert {"templates.npz", "detections.csv", "evaluation/sizing.csv"} <= set(of_all)
    assert [name for name in of_all if after[name] != before[name]] == []
    results = project.results, finished.results
    ours, theirs = (Results.of_table(each, each / "recordings.csv") for each in results)
    for name in theirs.names:
        np.testing.assert_array_equal(ours.signal(name), theirs.signal(name))
        np.testing.assert_array_equal(ours.matrix(name), theirs.matrix(name))
    for row in project.table("recordings.csv"):
        if row["status"] == "rejected" and row["batch"] and "same content" not in row["reason"]:
            assert np.isnan(ours.matrix(row["recording"])).all()


def test_no_text_runs_as_a_command_as_html_on_a_page_or_as_a_formula_in_a_table(mixed):
    project, _ = mixed
    found = [*project.folder.rglob("*pwned"), *project.folder.parent.glob("*pwned")]
    assert [path for path in found if path.parent != project.raw / "3mm"] == []
    for page in (*project.results.rglob("*.html"), *project.results.rglob("*.svg")):
        text = page.read_text(encoding="utf-8")
        assert not [each for each in (HOSTILE, "<img src=x", "<b>3mm") if each in text]
    tables = [each.read_text(encoding="utf-8") for each in project.results.rglob("*.csv")]
    cells = [cell for text in tables for row in csv.reader(text.splitlines()) for cell in row]
    assert {" =1+1.csv", " \uff1d1+1.csv", f" ={HOSTILE} formula of the tests"} <= set(cells)
    starts = [cell for cell in cells if cell.startswith(("=", "+", "-", "@", "\uff1d"))]
    assert [cell for cell in starts if not re.fullmatch(r"-[0-9.]+(e-?[0-9]+)?", cell)] == []


def test_on_request_the_run_stops_before_any_fit_and_names_them_all(mixed):
    project, _ = mixed
    run = project.snakemake("--config", "on_rejected=fail")
    assert run.status != 0
    assert not run.jobs["fit"]
    for path, (_, reason) in UNUSABLE.items():
        told = rf"\n  {re.escape(f'{listed_as(path)}: ')}.*{re.escape(reason)}"
        assert re.search(told, run.output)
    assert "set on_rejected: report in config/config.yaml" in run.output
