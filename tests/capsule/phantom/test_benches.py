"""The table of parameters, changes to it, and benches: what each may hold, and whence it came."""

import re
import sys
from unittest.mock import Mock

import numpy as np
import pytest
import study_phantom
import yaml
from phantom_study import calibrate

from capsule.errors import CapsuleError
from capsule.phantom import parameters
from capsule.phantom.files import BENCHES, DEFAULT_TABLE, bench_file
from capsule.phantom.parameters import bench_values, phantom_from_table, value_of, with_values
from capsule.phantom.simulation import simulate_run
from support.project import ROOT

STUDIES = ROOT / "workflow/studies"
PAGE = (STUDIES / "benches.md").read_text(encoding="utf-8")
NAMES = sorted(path.stem for path in BENCHES.glob("*.yaml"))
TABLE = yaml.safe_load(DEFAULT_TABLE.read_text(encoding="utf-8"))
USUAL = phantom_from_table(TABLE)
NOISE = {"value": 0.5, "unit": "1", "source": "assumed"}
LOUD = {"explains": "Noise hides nodules.", "sensor": {"noise": NOISE}}


def test_a_bench_changes_what_it_holds_and_the_table_holds_all():
    assert bench_values(TABLE, LOUD) == {"sensor.noise": 0.5}
    names = [f"{part}.{key}" for part, entries in TABLE.items() for key in entries]
    assert names == parameters.parameter_names()
    assert all(entry["meaning"] for entries in TABLE.values() for entry in entries.values())
    with pytest.raises(CapsuleError, match="is empty"):
        phantom_from_table(None)
    with pytest.raises(CapsuleError, match=r"wall\.lumen_mm is missing"):
        phantom_from_table({part: TABLE[part] for part in TABLE if part != "wall"})


def test_an_unknown_bench_is_answered_with_the_nearest_or_all():
    for name, told in (("uneven-wal", "did you mean uneven-wall"), ("../phantom", "allowed are")):
        with pytest.raises(CapsuleError, match=rf"no bench {name} .*{told}"):
            bench_file(name)


@pytest.mark.parametrize(
    ("bench", "message"),
    [
        (None, "begins with 'explains:'"),
        (LOUD | {"sensor": 0.5}, "sensor: needs parameters"),
        (LOUD | {"sensor": {"noise": 0.5}}, r"sensor\.noise: write it as"),
        (LOUD | {"sensor": {"noise": NOISE | {"unit": "V"}}}, r"the unit is 1, not V"),
        (LOUD | {"sensor": {"noise": NOISE | {"value": "loud"}}}, "'loud' is not a number"),
        (LOUD | {"sensor": {"noise": NOISE | {"source": "hearsay"}}}, "'hearsay' is not one of"),
    ],
)
def test_a_wrong_bench_is_answered_with_name_and_remedy(bench, message):
    with pytest.raises(CapsuleError, match=message):
        bench_values(TABLE, bench)


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ("sensor.noise=loud", "--set sensor.noise=loud: write sensor.noise=NUMBER"),
        ("sensor.noise=nan", "sensor.noise is nan; allowed is a number from 0 on"),
        ("electronics.adc_bits=9.5", "electronics.adc_bits is 9.5; allowed are whole numbers"),
        ("advance.stick_probability=1", "stick_probability is 1; allowed is 0 to 0.99"),
        ("wall.speed_mm_s=0", "wall.speed_mm_s is 0; allowed is a number greater than 0"),
        ("origami.fold_side=left", "origami.fold_side is left; allowed are head, tail"),
        ("sensor.noize=1", "no parameter sensor.noize; did you mean sensor.noise?"),
        ("sensor.colour=1", "no parameter sensor.colour; config/phantom.yaml lists all"),
    ],
)
def test_a_change_that_cannot_be_made_is_told_by_name(change, told):
    with pytest.raises(CapsuleError, match=re.escape(told)):
        with_values(USUAL, dict([parameters.parsed(change)]))


@pytest.mark.parametrize("name", NAMES)
def test_a_bench_that_ships_differs_from_the_usual_one_in_all_that_it_holds(name):
    bench = yaml.safe_load(bench_file(name).read_text(encoding="utf-8"))
    values = bench_values(TABLE, bench)
    phantom = with_values(USUAL, values)
    runs = ["2mm/r01", "2mm/r01", "2mm/r02"]
    first, again, other = (simulate_run(phantom, 2.0, 3, run).counts for run in runs)
    np.testing.assert_array_equal(first, again)
    assert first.tobytes() != other.tobytes()
    assert 300 < first.shape[1] < 1000
    for each, value in values.items():
        part, key = each.split(".")
        # What was searched for may end where the usual bench is.
        searched = "range" in bench[part][key]
        assert value != value_of(USUAL, each) or searched, each
        assert (bench[part][key]["source"] == "calibrated") == searched, each
        # It acts on a run. In these no awn is caught.
        without = with_values(phantom, {each: value_of(USUAL, each)})
        same = simulate_run(without, 2.0, 3, runs[0]).counts.tobytes() == first.tobytes()
        assert same == (each in ("advance.hold_waves", "advance.catch_probability")), each


@pytest.mark.slow
@pytest.mark.parametrize("name", [None, *NAMES])
def test_the_values_that_ship_are_what_the_search_found(name, tmp_path, monkeypatch):
    """Every trial is in the log, so the whole search is followed without simulating anything."""
    monkeypatch.setattr(calibrate, "try_out", Mock(side_effect=AssertionError("not in the log")))
    log, output = tmp_path / "log.csv", tmp_path / "found.yaml"
    kept = f"benches/{name}-calibration.csv" if name else "phantom-calibration.csv"
    shipped = STUDIES / "results" / kept
    log.write_bytes(shipped.read_bytes())
    command = "calibrate --log LOG --output FOUND"
    if name:  # As the page prints it.
        command = re.search(r"study_phantom\.py (calibrate (?:.*\\\n)*.*)", PAGE)[1]
    replaced = {"NAME": name, "LOG": str(log), "FOUND": str(output)}
    arguments = [replaced.get(word, word) for word in command.replace("\\\n", " ").split()]
    monkeypatch.setattr(sys, "argv", ["study_phantom.py", *arguments])
    study_phantom.main()
    assert output.read_bytes() == (bench_file(name) if name else DEFAULT_TABLE).read_bytes()
    assert log.read_bytes() == shipped.read_bytes()
