"""Every extension of docs/workflow.md works in a copy of the project."""

import json
import re
import shutil
import sys
from pathlib import Path

import numpy as np
import pytest

from support.command import output_of
from support.project import ROOT, Project

pytestmark = pytest.mark.slow

PAGE = ROOT / "docs" / "workflow.md"
_ROW = re.compile(r"\| `(?P<file>[^`]+)` \| (?P<change>.+) \|")
_NEW = re.compile(r"new: as \[(?P<example>[^]]+)\]\((?P=example)\)")
_CODE = r"(?:`` ?(?P<{0}_long>.+?) ?``|`(?P<{0}>[^`]+)`)"
_EDIT = re.compile(
    r"(?P<how>below|instead of) " + _CODE.format("anchor") + ": " + _CODE.format("text")
)


def extend(folder: Path, title: str) -> None:
    """Make the changes in the table of a section, in a copy of the project."""
    _, _, rest = PAGE.read_text(encoding="utf-8").partition(f"## {title}\n")
    for row in re.findall(r"^\| `.*", rest.partition("\n##")[0], re.MULTILINE):
        name, change = _ROW.fullmatch(row).groups()
        path = folder / name
        if new := _NEW.fullmatch(change):
            assert not path.exists(), f"{name} exists already"
            path.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(PAGE.parent / new["example"], path)
            continue
        edit, content = _EDIT.fullmatch(change), path.read_text(encoding="utf-8")
        anchor, text = edit["anchor"] or edit["anchor_long"], edit["text"] or edit["text_long"]
        assert content.count(anchor) == 1, f"{name} holds {anchor!r} not once"
        if edit["how"] == "below":
            (anchor,) = (line for line in content.splitlines() if anchor in line)
            text = f"{anchor}\n{text}"
        path.write_text(content.replace(anchor, text), encoding="utf-8")


def simulate(folder, *options):
    """Call capsule simulate of a copy of the project."""
    output_of(sys.executable, "workflow/scripts/capsule", "simulate", *options, cwd=folder)


TOGETHER = ["A new detector", "A new figure", "A new header line, as a column", "A fifth sensor"]
TOGETHER += ["A new bench for the phantom"]


@pytest.mark.workflow
def test_a_new_detector_figure_header_line_sensor_and_bench_work_from_their_files_on(tmp_path):
    folder = tmp_path / "extended"
    project = Project.create(folder)
    (folder / "config/config.yaml").write_bytes((ROOT / "config/config.yaml").read_bytes())
    for title in TOGETHER:
        extend(folder, title)
    project.configure(fit={"particles": 20, "iterations": 20})
    simulate(folder, "--runs", "3", "--sizes", "0", "3")
    (project.raw / "unlabelled").mkdir()
    (project.raw / "3mm/r03.csv").rename(project.raw / "unlabelled/patient.csv")
    named = project.raw / "3mm/r01.csv"
    named.write_text("# operator: Ann\n" + named.read_text(encoding="utf-8"), encoding="utf-8")
    run = project.snakemake()
    assert run.status == 0, run.output
    page = (project.results / "report.html").read_text(encoding="utf-8")
    # The detector, which judges by the command too.
    for name in ("evaluation/predictions.csv", "evaluation/summary.csv", "detections.csv"):
        assert "loudest" in {row["detector"] for row in project.table(name)}
    assert "the highest envelope against a threshold" in page
    call = ["workflow/scripts/capsule", "judge", "--json", "raw/unlabelled/patient.csv"]
    (judged,) = json.loads(output_of(sys.executable, *call, cwd=folder))
    (row,) = [row for row in project.table("detections.csv") if row["detector"] == "loudest"]
    assert judged["verdicts"]["loudest"]["score"] == float(row["score"])
    # The figure.
    assert len(project.table("figures/scores.csv")) == 5
    assert 'id="figure-scores"' in page
    # The header line.
    rows = {row["recording"]: row for row in project.table("recordings.csv")}
    assert [name for name, row in rows.items() if row["operator"] == "Ann"] == ["3mm/r01"]
    # The bench.
    simulate(folder, "--bench", "firm-wall", "--runs", "1", "--sizes", "3", "--out", "other")
    other = (folder / "other/3mm/r01.csv").read_text(encoding="utf-8")
    assert other != named.read_text(encoding="utf-8").partition("\n")[2]
    # The sensor.
    assert {row["status"] for row in rows.values()} == {"accepted"}
    with np.load(project.results / "templates.npz") as templates:
        assert templates["3mm"].shape == (5, 1250)
