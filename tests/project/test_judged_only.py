"""The benches that judge only are what studies/benches.md says, and do so."""

from functools import cache

import numpy as np
import pytest

from benchmarks import judged_only
from benchmarks.judged_only import Passed
from capsule.phantom.files import BENCHES, DEFAULT_TABLE, read_phantom
from capsule.phantom.simulation import simulate_run
from support.project import ROOT

SITE = "3mm/r01"
# Each trouble with a strength of nothing.
WITHOUT = {
    "breathing-patient": {"pressure_kpa": (0, 0), "coughs_per_s": 0},
    "wetted-sensors": {"conductivity_s_m": 0},
    "sticky-mucus": {"rests": 0, "returns": 0},
    "food-residue": {"lumps_per_mm": 0, "clinging": 0},
    "unshielded-cable": {"one_over_f": 0, "mains_v": 0},
    "losing-logger": {"losses_per_s": 0},
}


@cache
def passed(seed=1, site=SITE, nodule_mm=3):
    phantom = read_phantom(DEFAULT_TABLE, [])
    return Passed(phantom, simulate_run(phantom, nodule_mm, seed, site), seed, site, "1")


def readings(bench, seed=1, site=SITE, **strength):
    return judged_only.BENCHES[bench].trouble(passed(seed, site), **strength)


def test_no_bench_has_the_name_of_one_that_chose():
    chose = {path.stem for path in BENCHES.glob("*.yaml")} | {"usual", "b", "b-clear"}
    assert not chose & set(judged_only.BENCHES)
    assert set(WITHOUT) == set(judged_only.BENCHES)


@pytest.mark.parametrize("bench", judged_only.BENCHES)
def test_readings_follow_from_the_seed_and_stay_in_the_converters_range(bench):
    first = readings(bench)
    assert first.shape[0] == 4
    assert np.issubdtype(first.dtype, np.integer)
    assert first.min() >= 0
    assert first.max() < 1024
    assert first.shape[1] <= 990
    assert np.array_equal(first, readings(bench))
    again = judged_only.simulate_judged_only(passed().phantom, bench, 3, 1, SITE)
    assert np.array_equal(first, again)
    # Another pass has another trouble, and another seed another bench.
    other = judged_only.simulate_judged_only(passed().phantom, bench, 3, 1, SITE, "2")
    assert first.shape != other.shape or not np.array_equal(first, other)


@pytest.mark.parametrize("bench", judged_only.BENCHES)
def test_a_trouble_without_strength_leaves_the_usual_readings(bench):
    usual = passed().run.counts
    assert np.array_equal(readings(bench, **WITHOUT[bench]), usual)
    several = [readings(bench, seed) for seed in range(1, 4)]
    assert any(
        one.shape != passed(seed).run.counts.shape or (one != passed(seed).run.counts).any()
        for seed, one in enumerate(several, 1)
    )


def test_breath_presses_on_all_sensors_at_once():
    usual = passed().run.counts
    change = usual - readings("breathing-patient", coughs_per_s=0, pressure_kpa=(2, 2))
    assert change.min() >= 0
    assert np.corrcoef(change)[np.triu_indices(4, 1)].min() > 0.3
    coughs = usual - readings("breathing-patient", pressure_kpa=(0, 0), coughs_per_s=0.2)
    assert (coughs.min(axis=0) > 20).any()
    # The sensors creep, so only most of the time is quiet.
    assert np.mean(coughs.max(axis=0) < 20) > 0.6


def test_wet_sensors_lose_gain_and_rest_value_but_not_at_the_start():
    usual, wet = passed().run.counts, readings("wetted-sensors")
    assert np.array_equal(usual[:, 0], wet[:, 0])
    assert (wet <= usual).all()
    # Wet from the first sample on, each sensor has 27 kOhm beside it.
    soaked = readings("wetted-sensors", film_spread=0, latest_s=0, spreading_s=1e-9)[:, 1:]
    ohms = 12000 * (usual[:, 1:] + 0.5) / (1023.5 - usual[:, 1:])
    beside = 1 / (1 / ohms + 1 / 26667)
    assert np.abs(soaked + 0.5 - 1024 * beside / (beside + 12000)).max() < 1.5
    assert np.ptp(soaked, axis=1).max() < 0.8 * np.ptp(usual, axis=1).max()


def test_mucus_repeats_whole_waves_and_stays_within_the_longest_run():
    usual = passed().run.counts
    rested = readings("sticky-mucus", rests=1, returns=0, rest_waves=(4, 4))
    assert (rested.shape[1] - usual.shape[1]) % 128 == 0
    longest = readings("sticky-mucus", rests=20, returns=20)
    assert longest.shape[1] == 990


def test_residue_is_felt_by_the_first_sensors_and_clings_to_one():
    usual = passed().run.counts
    lumps = [
        usual - readings("food-residue", clinging=0, lumps_per_mm=0.5, seed=1, left=0.4),
        usual - readings("food-residue", clinging=0, lumps_per_mm=0.5, seed=1, left=0.0),
    ]
    assert lumps[0].max(axis=1)[0] > 2 * lumps[0].max(axis=1)[3]
    # What no awn leaves reaches the first sensor alone.
    assert (lumps[1][1:] == 0).all()
    assert (lumps[1][0] != 0).any()
    clung = usual - readings("food-residue", clinging=50, lumps_per_mm=0, clings_s=(10, 30))
    assert (clung.max(axis=1) > 0).all()
    assert clung.min() >= 0


def test_hum_has_one_phase_in_all_sensors_and_noise_is_each_sensors_own():
    usual = passed().run.counts.astype(float)
    hum = readings("unshielded-cable", one_over_f=0) - usual
    assert np.corrcoef(hum)[np.triu_indices(4, 1)].min() > 0.8
    assert 1 < np.abs(hum).max() < 60
    noise = readings("unshielded-cable", mains_v=0, one_over_f=1e-4) - usual
    power = np.abs(np.fft.rfft(noise - noise.mean(axis=1, keepdims=True))) ** 2
    assert power[:, 1:20].mean() > 5 * power[:, -200:].mean()


def test_lost_rows_are_cut_out_of_all_sensors():
    usual = passed().run.counts
    left = readings("losing-logger", losses_per_s=0.1)
    assert left.shape[1] < usual.shape[1]
    rows = iter(usual.T.tolist())
    assert all(row in rows for row in left.T.tolist())


def test_the_manual_names_every_bench_that_judges_only():
    text = (ROOT / "workflow/studies/benches.md").read_text(encoding="utf-8")
    for name, bench in judged_only.BENCHES.items():
        assert f"| `{name}` | {bench.explains} | {bench.nearest} |" in text
