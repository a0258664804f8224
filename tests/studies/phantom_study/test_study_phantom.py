"""The commands that study the phantom read their arguments and write their files."""

import sys

import pytest
import study_phantom
import yaml
from phantom_study import draw
from phantom_study.simulated_archive import DEFAULT_CONFIG

from capsule.engine.configuration import read_config_file
from capsule.store.files import read_csv


def run(monkeypatch, *arguments):
    monkeypatch.setattr(sys, "argv", ["study_phantom.py", *map(str, arguments)])
    study_phantom.main()


@pytest.mark.slow
@pytest.mark.takes
def test_the_figures_and_tables_of_the_documentation_can_be_made(tmp_path, monkeypatch, capsys):
    table = tmp_path / "cells.csv"
    run(monkeypatch, "judge", "--archives", 2, "--runs", 2, "--quick", "--output", table)
    assert len(read_csv(table)) == 22
    assert "mean absolute difference" in capsys.readouterr().out
    monkeypatch.setattr(draw, "VARIATIONS", {"noise": (("sensor.noise",), (1, 32))})
    # How good the templates are does not matter here: a hundred fits take as long as all else.
    settings, config = read_config_file(DEFAULT_CONFIG), tmp_path / "config.yaml"
    settings["fit"] |= {"particles": 20, "iterations": 20}
    config.write_text(yaml.safe_dump(settings), encoding="utf-8")
    options = ["--archives", 1, "--runs", 2, "--table", table, "--output", tmp_path]
    options += ["--config", config]
    run(monkeypatch, "draw", *options)
    rows = read_csv(tmp_path / "phantom-sensitivity.csv")
    assert [row.pop("level") for row in rows] == ["1", "32", "none", "dead", "saturated"]
    assert [row.pop("variation") for row in rows] == 2 * ["noise"] + 3 * ["one faulty sensor"]
    # The calibrated bench without a fault is met twice, each time with the same templates.
    assert rows[0] == rows[2]
    assert len(read_csv(tmp_path / "phantom-signals.csv")) == 6
    for name in ("signals", "table", "sensitivity"):
        assert "<svg" in (tmp_path / f"phantom-{name}.svg").read_text(encoding="utf-8")
