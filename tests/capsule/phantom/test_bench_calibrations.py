"""Of each bench that ships: its values are its search's winner; the page shows what was judged."""

import re
import shlex
import sys
from pathlib import Path

import numpy as np
import pytest
import study_phantom
from phantom_study import calibrate

from capsule.phantom.files import BENCHES, DEFAULT_TABLE, bench_file
from capsule.store.files import read_csv

pytestmark = pytest.mark.slow

STUDIES = Path(__file__).resolve().parents[3] / "workflow" / "studies"
PAGE = (STUDIES / "benches.md").read_text(encoding="utf-8")
NAMES = sorted(path.stem for path in BENCHES.glob("*.yaml"))


def command_on_the_page(study):
    """Return the arguments of a study as the page prints its command."""
    lines = re.search(rf"study_phantom\.py ({study} (?:.*\\\n)*.*)", PAGE)[1]
    return shlex.split(lines.replace("\\\n", " "))


@pytest.mark.parametrize("name", [None, *NAMES])
def test_the_values_that_ship_are_what_the_search_found(name, tmp_path, monkeypatch):
    """Every trial is in the log, so the whole search is followed without simulating anything."""

    def nothing_is_missing(*arguments):
        raise AssertionError(f"the log lacks a trial: {arguments}")

    monkeypatch.setattr(calibrate, "try_out", nothing_is_missing)
    log, output = tmp_path / "log.csv", tmp_path / "found.yaml"
    kept = f"benches/{name}-calibration.csv" if name else "phantom-calibration.csv"
    shipped = STUDIES / "results" / kept
    log.write_bytes(shipped.read_bytes())
    arguments = ["calibrate", "--log", str(log), "--output", str(output)]
    if name:
        replaced = {"NAME": name, "LOG": str(log), "FOUND": str(output)}
        arguments = [replaced.get(word, word) for word in command_on_the_page("calibrate")]
    monkeypatch.setattr(sys, "argv", ["study_phantom.py", *arguments])
    study_phantom.main()
    assert output.read_bytes() == (bench_file(name) if name else DEFAULT_TABLE).read_bytes()
    assert log.read_bytes() == shipped.read_bytes()


def judged(name):
    return {row["cell"]: row for row in read_csv(STUDIES / f"results/benches/{name}.csv")}


@pytest.mark.parametrize("name", NAMES)
def test_a_bench_gives_the_papers_table_by_its_own_mechanism_and_the_page_shows_it(name):
    cells, without = judged(f"{name}-table"), judged(f"{name}-without")
    off = {cell: float(row["mean"]) - float(row["paper"]) for cell, row in cells.items()}
    worst = max(off, key=lambda cell: abs(off[cell]))
    mean = np.mean([abs(value) for value in off.values()])
    assert mean <= 8
    inside = sum(row["inside"] == "True" for row in cells.values())
    rates = " for ".join(f"{float(cells[worst][key]):.0f}" for key in ("mean", "paper"))
    assert f"| `{name}` | {mean:.1f} | {inside} of {len(cells)} | {worst}: {rates} |" in PAGE
    with_it, alone = (
        [float(each[cell]["mean"]) for cell in ("specificity", "recall 1 mm")]
        for each in (cells, without)
    )
    told = [" | ".join(f"{rate:.0f}" for rate in both) for both in (with_it, alone)]
    assert f"| `{name}` | {' | '.join(told)} |" in PAGE
    # Without its mechanism, the paper's detector tells healthy runs from 1 mm far better.
    assert sum(alone) > sum(with_it) + 20
