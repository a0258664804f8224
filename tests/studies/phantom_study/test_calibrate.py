"""The search for the phantom's parameters continues its log, and finds the shipped values."""

import sys
from pathlib import Path

import numpy as np
import pytest
import study_phantom
from phantom_study import calibrate
from phantom_study.paper_table import read_paper_table

from capsule.errors import CapsuleError
from capsule.phantom.files import DEFAULT_TABLE
from capsule.store.files import read_csv

pytestmark = pytest.mark.slow

LOG = Path(__file__).resolve().parents[3] / "docs/phantom-calibration.csv"


def run(monkeypatch, log, output, *options):
    command = [
        "study_phantom.py",
        "calibrate",
        *options,
        "--log",
        str(log),
        "--output",
        str(output),
    ]
    monkeypatch.setattr(sys, "argv", command)
    study_phantom.main()
    return output.read_text(encoding="utf-8")


def test_the_values_that_ship_are_what_the_search_found(tmp_path, monkeypatch):
    """Every trial is in the log, so the search runs without a simulation."""

    def nothing_is_missing(*arguments):
        raise AssertionError(f"the log lacks a trial: {arguments}")

    monkeypatch.setattr(calibrate, "try_out", nothing_is_missing)
    log = tmp_path / "log.csv"
    log.write_bytes(LOG.read_bytes())
    shipped = DEFAULT_TABLE.read_text(encoding="utf-8")
    assert run(monkeypatch, log, tmp_path / "winner.yaml") == shipped
    assert log.read_bytes() == LOG.read_bytes()


@pytest.mark.takes
def test_an_interrupted_search_goes_on_and_ends_the_same(tmp_path, monkeypatch, capsys):
    options = ["--generations", "1", "--candidates", "2", "--archives", "1"]
    options += ["--finalists", "1", "--final-archives", "1"]
    log = tmp_path / "log.csv"
    winner = run(monkeypatch, log, tmp_path / "winner.yaml", *options, "--jobs", "2")
    assert (
        "generation 1 of 1: difference from the paper, in spreads: median"
        in capsys.readouterr().out
    )
    rows, paper = read_csv(log), read_paper_table()
    assert [row["stage"] for row in rows] == ["generation 1", "generation 1", "final 1 candidate 1"]
    assert all(np.isfinite(calibrate.mean_distance([row], paper)) for row in rows)
    whole = log.read_text(encoding="utf-8")
    log.write_text("".join(whole.splitlines(keepends=True)[:2]), encoding="utf-8")
    assert run(monkeypatch, log, tmp_path / "again.yaml", *options) == winner
    assert log.read_text(encoding="utf-8") == whole


def test_a_log_of_another_search_is_refused(tmp_path, monkeypatch):
    log = tmp_path / "log.csv"
    log.write_bytes(LOG.read_bytes())
    with pytest.raises(CapsuleError, match="has other candidates than this search"):
        run(monkeypatch, log, tmp_path / "winner.yaml", "--seed", "2")
