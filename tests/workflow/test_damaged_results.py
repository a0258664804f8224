"""Some damaged files of each kind for each reader; `fuzz_results.py` tries thousands by hand."""

from itertools import cycle
from pathlib import Path

import numpy as np
import pytest

from support.damaged_results import KINDS, call, change, read_files, readers
from support.marks import needs_process_groups
from support.plain_figures import draw_plain_figures
from support.project import Project

pytestmark = [
    pytest.mark.slow,
    pytest.mark.workflow,
    pytest.mark.takes(35),
    needs_process_groups,
]

# These compute for seconds with most damaged files; `fuzz_results.py` tries them.
LONG = {"fit", "describe", "evaluate", "detect", "report", "verify"}
# Each change of `KINDS` once for a command. A job takes longer, and an export of all opens many
# files, so one change of each file for them, by turns.
BY_TURNS = {"list", "list_labelled", "templates", "export all"}
NAMES = [*(f"0mm/r{run}" for run in range(1, 5)), "3mm/r1", "3mm/r2", "unlabelled/p"]
few = {"particles": 10, "iterations": 10}


def test_no_reader_ends_in_a_traceback(tmp_path, monkeypatch):
    project = Project.create(tmp_path / "project", NAMES, 400, **few)
    other = Project.create(tmp_path / "other", [*NAMES, "2mm/r1"], 500, **few)
    for each in (project, other):
        draw_plain_figures(each.folder)
        run = each.snakemake()
        assert run.status == 0, run.output
    monkeypatch.chdir(project.folder)
    rng, tried, faults, turns = np.random.default_rng(1), 0, [], cycle(KINDS)
    called = {name: each for name, each in readers(project.folder).items() if name not in LONG}
    for name, usual_s, opened in read_files(called):
        for kind, file in opened.items():
            path = Path(file)
            whole = path.read_bytes()
            swapped = (other.folder / file).read_bytes()
            for how in [next(turns)] if name in BY_TURNS else KINDS:
                path.write_bytes(change(whole, swapped, how, rng))
                tried += 1
                if fault := call(called[name]).fault(file, usual_s):
                    faults.append((name, kind, how, fault))
            path.write_bytes(whole)
    assert tried >= 100
    assert not faults
