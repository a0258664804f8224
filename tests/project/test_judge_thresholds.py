"""How judge_thresholds.py tells ranking from threshold, on pools whose scores are drawn."""

import importlib

import numpy as np
import pytest

from capsule.detectors.network import EMBEDDED
from support.project import ROOT

CONFIG = {"taught": {"height": 3.0, "penalty": 1.0, "evidence_weight": 1.0}}
NODULE = {1.0: 1.0, 2.0: 2.0}
ARCHIVES = 12


@pytest.fixture
def module(monkeypatch):
    """Return a function that imports a module of the benchmarks by its name."""
    monkeypatch.syspath_prepend(str(ROOT / "tests" / "benchmarks"))
    return importlib.import_module


@pytest.fixture
def pools(module):
    return module("healthy_pools")


@pytest.fixture
def rates(module):
    return module("threshold_rates")


def drawn(pools, outside, archives=ARCHIVES):
    """Draw scores of archives with 20 recordings of each size, and of healthy ones outside."""
    numbers = np.random.default_rng(1)
    archive = np.append(np.repeat(np.arange(archives), 60), np.full(outside, pools.OUTSIDE))
    sizes_mm = np.append(np.tile(np.repeat([0.0, 1.0, 2.0], 20), archives), np.zeros(outside))
    scores = numbers.normal(size=sizes_mm.size)
    for size, rise in NODULE.items():
        scores[sizes_mm == size] += rise
    # Neither gradients nor embeddings tell anything.
    gradients = numbers.normal(size=(scores.size, 5)) * 1e-3
    seen = np.column_stack([scores, gradients, np.zeros((scores.size, EMBEDDED))])
    return pools.Pool("drawn", archive, sizes_mm, seen, scores)


def plain_ranking(pool):
    """Return the shares of nodules above the quantile of all healthy scores, as drawn."""
    quantile = np.quantile(pool.evidence[pool.sizes_mm == 0], 0.95)
    return [np.mean(pool.evidence[pool.sizes_mm == size] > quantile) for size in NODULE]


def test_the_ranking_is_that_at_the_quantile_of_all_healthy_recordings(pools, rates):
    pool = drawn(pools, 3000)
    assert rates.ranking(pool, CONFIG) == pytest.approx(plain_ranking(pool), abs=0.03)
    assert rates.ranking_by_many(pool, CONFIG)[0] == pytest.approx(plain_ranking(pool), abs=0.03)


def test_more_healthy_recordings_win_back_what_the_threshold_costs(pools, rates):
    pool = drawn(pools, 400)
    few, many = (rates.verdicts(pool, healthy, 10, CONFIG) for healthy in (20, 160))
    assert few[1] < many[1] == pytest.approx(rates.ranking(pool, CONFIG)[1], abs=0.05)
    assert few[2] == pytest.approx(0.95, abs=0.02)
    assert many[2] == pytest.approx(0.95, abs=0.02)


def test_of_a_stored_bench_the_further_ones_are_of_its_other_archives(pools, rates):
    pool = drawn(pools, 0, archives=3)
    for number, own, others in rates.archives_of(pool, 2):
        assert set(pool.archive[own]) == {number}
        assert set(pool.archive[others]) == {0, 1, 2} - {number}
        assert set(pool.sizes_mm[others]) == {0.0}
        assert others.size == 40
    assert len(rates.verdicts(pool, 40, 2, CONFIG)) == 3
    # No twenty are left to measure the specificity.
    assert rates.verdicts(pool, 60, 2, CONFIG) == []
    shares, taught = rates.ranking_by_many(pool, CONFIG)
    assert taught == 120
    assert shares == pytest.approx(plain_ranking(pool), abs=0.1)


def test_no_recording_that_teaches_is_judged_by_many(pools, rates, monkeypatch):
    pool = drawn(pools, 100, archives=4)
    taught = []
    best = rates._best_of_penalties
    monkeypatch.setattr(
        rates, "_best_of_penalties", lambda *of: (taught.append(of[1]), best(*of))[1]
    )
    _, count = rates.ranking_by_many(pool, CONFIG)
    assert count == 120
    assert [set(pool.archive[teaches]) for teaches in taught] == [{1, 3}, {0, 2}]


def test_a_recording_without_a_verdict_is_missed_and_sets_no_threshold(pools, rates):
    pool = drawn(pools, 100)
    pool.seen[pool.sizes_mm == 1.0] = np.nan
    pool.seen[np.flatnonzero(pool.archive == pools.OUTSIDE)[:50]] = np.nan
    assert rates.verdicts(pool, 40, 5, CONFIG)[0] == 0
    assert rates.verdicts(pool, 40, 5, CONFIG)[2] < 0.6


def test_a_pool_is_simulated_with_seeds_of_its_own_and_kept(pools, monkeypatch, tmp_path, module):
    monkeypatch.setattr(pools, "ARCHIVES", 1)
    monkeypatch.setattr(pools, "HEALTHY", 2)
    judging = module("judge_thresholds")
    config = judging.read_config_file(ROOT / "config/config.yaml")
    pool = pools.pool_of("uneven-wall", None, config, judging.WEIGHTS, tmp_path)
    assert np.count_nonzero(pool.archive == 0) == 120
    assert pool.sizes_mm[pool.archive == pools.OUTSIDE].tolist() == [0.0, 0.0]
    assert np.unique(pool.evidence).size == 122
    monkeypatch.setattr(pools, "describe", None)
    kept = pools.pool_of("uneven-wall", None, config, judging.WEIGHTS, tmp_path)
    assert np.array_equal(kept.seen, pool.seen)
    monkeypatch.setattr(pools, "HEALTHY", 1)
    with pytest.raises(TypeError):
        pools.pool_of("uneven-wall", None, config, judging.WEIGHTS, tmp_path)


def test_the_limit_of_every_bench_is_known(module):
    judging = module("judge_thresholds")
    limits = judging.limits(
        (ROOT / "workflow/studies/results/detection-limits.md").read_text(encoding="utf-8")
    )
    assert set(limits) == {*judging.bench_names(), "b", "b-clear"}
    assert limits["uneven-wall"] == [0.77, 0.997]


def test_the_answer_says_what_ranking_and_threshold_cost(module):
    judging = module("judge_thresholds")
    far = judging.Losses([0.8, 1.0], [0.7, 1.0], 2400, [0.6, 0.97], {20: [0.4, 0.9, 0.95]})
    near = judging.Losses([0.8, 1.0], [0.8, 1.0], 2400, [0.8, 0.98], {20: [0.7, 0.96, 0.95]})
    text = judging.answer({"far": far, "near": near})
    assert "in points: `far` 20.0 and 20.0.\n" in text
    assert "the ranking costs at most 3.0 points, and the threshold of 20 at most 7.0." in text
    table = judging.losses_table({"far": far})
    assert "| far | 80 / 100 | 70 / 100 (by 2,400) | 60 / 97 | 40 / 90 / 95 |" in table


def test_the_manual_shows_every_bench_that_was_judged(module):
    judging = module("judge_thresholds")
    page = (ROOT / "workflow/studies/detection.md").read_text(encoding="utf-8")
    block = page.partition("<!-- judge_thresholds: losses -->")[2].partition("<!-- end")[0]
    benches = {line.split(" | ")[0].strip("| ") for line in block.splitlines()[3:] if line}
    assert benches == {*judging.bench_names(), "b", "b-clear"}
