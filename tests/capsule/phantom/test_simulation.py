"""Whole simulated runs, and the command that writes them."""

import io
from pathlib import Path

import numpy as np
import pytest

from capsule.engine.project import CONFIG
from capsule.errors import CapsuleError
from capsule.method.preprocessing import preprocess
from capsule.phantom import files as phantom
from capsule.phantom.parameters import with_values
from capsule.phantom.simulation import planned_runs, recording_of, simulate_run
from capsule.recordings.recording import format_recording, read_recording, source_of
from support.command import run_command

PHANTOM = phantom.read_phantom(phantom.DEFAULT_TABLE, [])
RANDOM = """wall.unevenness_mm contact.series_offset_mm contact.height_offset_mm
    contact.coupling_spread contact.wander_mm advance.speed_spread advance.stroke_spread
    advance.stick_probability advance.catch_probability sensor.settling sensor.drift_per_s
    sensor.noise"""
QUIET = with_values(PHANTOM, dict.fromkeys(RANDOM.split(), 0.0))


def matrix_of(run):
    return preprocess(run.counts.astype(float), window=84, threshold=1.0, length=1000)


def test_same_seed_and_bench_same_bytes_whatever_else_is_made(tmp_path):
    def made(*options):
        out = tmp_path / f"made-{len(list(tmp_path.iterdir()))}"
        run_command("simulate", "--out", out, "--runs", 1, "--sizes", 3, *options)
        return (out / "3mm/r01.csv").read_bytes()

    uneven, changed = ["--bench", "uneven-wall"], ["--set", "sensor.noise=0.1"]
    first, *others = (made(*each) for each in ([], ["--seed", 2], uneven, [*uneven, *changed]))
    assert made("--runs", 2, "--sizes", 0, 3) == first
    read = [read_recording(io.BytesIO(each), sensors=4) for each in (first, *others)]
    assert len({recording.values.tobytes() for recording in read}) == 4
    assert "bench uneven-wall, seed 1" in source_of(read[2].header)
    assert b"bench" not in first


def test_a_file_says_that_it_is_simulated_and_of_which_archive_and_reads_back():
    run, healthy = (simulate_run(PHANTOM, size_mm, 7, "2mm/r01") for size_mm in (2.0, 0.0))
    for seed, bench, archive in (
        (7, None, "simulated-7"), (8, None, "simulated-8"), (7, "uneven-wall", "uneven-wall-7"),
    ):  # fmt: skip
        content = format_recording(recording_of(run, PHANTOM, seed, "2mm/r01", bench))
        recording = read_recording(io.BytesIO(content), sensors=4)
        header = recording.header
        assert (header["source"], header["simulator_seed"]) == ("simulated phantom", str(seed))
        assert (header["site"], header["setup"]) == (f"{archive}/2mm/r01", f"{archive}/2mm")
        assert float(header["nodule_at_mm"]) == pytest.approx(run.nodule_at_mm, abs=0.01)
        np.testing.assert_array_equal(recording.values, run.counts)
        np.testing.assert_allclose(np.diff(recording.time_s), 0.1)
    assert "nodule_at_mm" not in recording_of(healthy, PHANTOM, 7, "2mm/r01").header


def test_a_larger_nodule_presses_more_and_gives_a_larger_signal():
    runs = [simulate_run(QUIET, size, 1, "quiet") for size in (0, 1, 2, 3, 4)]
    assert (np.diff([run.compression_mm.max() for run in runs]) > 0).all()
    # The matrix is normalized: what 1 mm adds is less than what a run's own length changes.
    healthy, *signals = [matrix_of(run).sum() for run in runs]
    assert (np.diff(signals) > 0).all()
    assert signals[-1] > 4 * healthy
    # However fast, a run has two samples.
    fast = with_values(QUIET, {"advance.speed_mm_s": 1e5, "advance.lead_mm": 0.0})
    assert simulate_run(fast, 0.0, 1, "fast").time_s.size == 2


def test_each_pass_has_its_own_draws_and_each_set_up_its_own_height():
    passes = planned_runs([3], 1, 3)
    assert [run.name for run in passes] == ["3mm/r01p1", "3mm/r01p2", "3mm/r01p3"]
    assert {run.site for run in passes} == {"3mm/r01"}
    runs = [simulate_run(PHANTOM, 3.0, 1, run.site, run.attempt) for run in passes]
    assert len({each.counts.tobytes() for each in runs}) == 3
    planned = planned_runs([0, 2], [2, 7], 1, [1, 3], "h")
    assert [run.name for run in planned[1::7]] == ["0mm/h02", "2mm/h07"]
    setups = 2 * ["0mm"] + 3 * ["2mm"] + 2 * ["2mm/2"] + 2 * ["2mm/3"]
    assert [run.setup for run in planned] == setups
    # Numbers that do not fit are refused.
    for runs, setups, told in (
        ([2, 2, 2], 1, "3 numbers for 2 sizes"),
        (2, [1, 3], "need as many"),
    ):
        with pytest.raises(CapsuleError, match=told):
            planned_runs([0, 2], runs, 1, setups)
    set_up = with_values(QUIET, {"contact.series_offset_mm": 0.8})
    usual, *others = (
        [simulate_run(set_up, 2.0, 1, run, setup=name).compression_mm.max() for run in "ab"]
        for name in (None, "2mm", "2mm/2", "2mm/3")
    )
    assert usual == others[0]
    assert np.diff(np.sort(others, axis=0)[:, 0]).min() > 3 * np.ptp(others, axis=1).max()


def test_existing_files_are_kept_unless_forced(tmp_path):
    (kept := tmp_path / "1mm/r01.csv").parent.mkdir()
    kept.write_text("mine")
    options = "simulate", "--out", tmp_path, "--sizes", 0, 1, "--runs", 1
    with pytest.raises(CapsuleError, match=r"r01\.csv exists; nothing was written.*--force"):
        run_command(*options)
    assert kept.read_text() == "mine"
    assert not (tmp_path / "0mm").exists()
    run_command(*options, "--force")
    assert kept.read_text() != "mine"


def test_the_archive_that_ships_is_what_seed_1_gives(tmp_path, capsys):
    shipped = CONFIG.parent / "raw"
    run_command("simulate", "--out", tmp_path, "--seed", 1)
    assert capsys.readouterr().err == f"\rsimulated 120 of 120 recordings in {tmp_path}/\n"
    made = sorted(path.relative_to(tmp_path) for path in tmp_path.rglob("*.csv"))
    assert made == [Path(f"{size}mm/r{run:02d}.csv") for size in range(6) for run in range(1, 21)]
    for name in made:
        assert (tmp_path / name).read_bytes() == (shipped / name).read_bytes(), name


# Strong enough that no run stays as it was.
MECHANISMS = [
    {"seat.strength_spread": 0.3},
    {"wall.unevenness_spread": 0.5, "wall.unevenness_mm": 0.3},
    {"contact.stray_probability": 1.0},
    *({f"wave.{name}": 0.3} for name in ("period_spread", "amplitude_spread")),
    *({f"wave.{name}": 0.5} for name in ("skew", "missing_probability")),
    {"wave.sharpness": 3.0},
    {"advance.slip_probability": 0.5},
    {"advance.slip_probability": 0.5, "seat.reseat_spread": 0.3},
    *({f"sensor.{name}": 0.5} for name in ("hysteresis", "release_peak", "crosstalk")),
    {"sensor.jump": 0.3, "sensor.jumps_per_s": 0.2},
]
MECHANISMS.append({name: value for values in MECHANISMS for name, value in values.items()})


@pytest.mark.parametrize("mechanism", MECHANISMS, ids=" ".join)
def test_a_mechanism_acts_on_a_run_and_every_draw_has_its_seed(mechanism):
    changed = with_values(PHANTOM, mechanism)
    usual = simulate_run(PHANTOM, 2.0, 3, "2mm/r01")
    first, again = (simulate_run(changed, 2.0, 3, "2mm/r01") for _ in range(2))
    np.testing.assert_array_equal(first.counts, again.counts)
    other = simulate_run(changed, 2.0, 3, "2mm/r02")
    assert len({run.counts.tobytes() for run in (usual, first, other)}) == 3
    assert 300 < first.time_s.size < 1000
    assert np.isfinite(matrix_of(first)).all()
