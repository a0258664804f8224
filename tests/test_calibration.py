"""The search's log, and that the values that ship are what the search found."""

import csv
import functools
import sys
from pathlib import Path

import numpy as np
import pytest
import yaml

import calibrate
from capsule.phantom import search
from capsule.phantom.parameters import rewritten
from phantom_edges import DEFAULT_TABLE

LOG = Path(__file__).resolve().parents[1] / "docs/phantom-calibration.csv"


def rows_of(log):
    with log.open(encoding="utf-8", newline="") as stream:
        return list(csv.DictReader(stream))


def test_the_values_that_ship_follow_from_the_log_of_the_search():
    """Replay the search with the losses that were measured, instead of measuring them anew."""
    text = DEFAULT_TABLE.read_text(encoding="utf-8")
    free = search.free_parameters(yaml.safe_load(text))
    trials = rows_of(LOG)
    last = int(trials[-1]["generation"])

    def losses_of(candidates, number):
        rows = [row for row in trials if int(row["generation"]) == number]
        for values, row in zip(candidates, rows, strict=True):
            assert values == pytest.approx({name: float(row[name]) for name in values})
        return [float(row["loss"]) for row in rows]

    draw = functools.partial(calibrate.candidate_numbers, 1)
    generations = search.evolve(free, losses_of, draw, candidates=28, spread=0.2, rate=0.5)
    for _ in range(last + 1):
        step = next(generations)
    assert rewritten(text, step.centre) == text


@pytest.mark.slow
def test_a_search_logs_every_trial_and_finds_the_same_again(tmp_path, monkeypatch, capsys):
    def run(name, jobs):
        log, output = tmp_path / f"{name}.csv", tmp_path / f"{name}.yaml"
        command = ["calibrate.py", "--generations", "1", "--candidates", "2", "--jobs", jobs]
        monkeypatch.setattr(sys, "argv", [*command, "--log", str(log), "--output", str(output)])
        calibrate.main()
        return rows_of(log), output.read_text(encoding="utf-8")

    trials, found = run("one", "1")
    assert len(trials) == 2
    assert all(np.isfinite(float(row["loss"])) for row in trials)
    assert found != DEFAULT_TABLE.read_text(encoding="utf-8")
    assert run("two", "2") == (trials, found)
    assert "generation 1 of 1: off by" in capsys.readouterr().out
