"""A trial can be repeated, is logged once, and its distance from the paper is right."""

import numpy as np
import pytest
from phantom_study import calibrate, simulated_archive
from phantom_study.calibrate import TrialLog
from phantom_study.paper_table import read_paper_table
from phantom_study.simulated_archive import quick, read_detector

from capsule.errors import CapsuleError
from capsule.method.particle import Particle
from capsule.method.templates import by_size
from capsule.phantom.files import DEFAULT_TABLE, read_phantom
from capsule.store.files import read_csv
from support.paper import LIKE_THE_PAPER
from support.project import ROOT

pytestmark = pytest.mark.takes(0.5)

LOG = ROOT / "workflow/studies/results/phantom-calibration.csv"
PAPER = read_paper_table()


def trial_of(confusion):
    return {"confusion": str(confusion.tolist())} | PAPER.motion


def test_a_value_that_the_table_has_no_line_for_is_not_written():
    """`tests/capsule/phantom/test_bench_calibrations.py` follows seven whole searches."""
    with pytest.raises(CapsuleError, match=r"no line 'advance\.sped"):
        calibrate.rewritten(DEFAULT_TABLE.read_text(encoding="utf-8"), {"advance.sped": 1.0})


@pytest.mark.slow
def test_a_logged_trial_can_be_made_again(monkeypatch):
    def averaged(fitted):
        # The templates of the log hold the mean of sigma, not the root of the mean variance.
        return {
            size: [Particle.from_vector(np.mean([each.to_vector() for each in particles], axis=0))]
            for size, particles in by_size(fitted).items()
        }

    monkeypatch.setattr(simulated_archive, "by_size", averaged)
    logged = read_csv(LOG)[0]
    values = {name: float(logged[name]) for name in logged if "." in name}
    phantom, detector = read_phantom(DEFAULT_TABLE, []), quick(read_detector())
    again = calibrate.try_out(phantom, detector, PAPER, values, int(logged["archive_seed"]))
    assert {name: str(value) for name, value in again.items()} | {"stage": "generation 1"} == logged


def test_the_shortfall_is_of_the_worst_cell_in_spreads_and_of_all_in_points():
    perfect = trial_of(20 * np.eye(6, dtype=int))
    paper = np.array(list(PAPER.cells.values()))
    # Everything is found and sized; the paper's last two cells are healthy runs with a size.
    off = np.abs(paper - np.where(np.arange(paper.size) >= paper.size - 2, 0.0, 100.0))
    # Archives that are all alike have the least spread, 1.5 points.
    expected = pytest.approx((off.max() / 1.5, off.mean()))
    assert calibrate.shortfall([perfect] * 3, PAPER) == expected
    # Two of the 3 mm runs taken for 4 mm: an exact rate of 45 instead of 55 %, and so a mean of
    # 50 %, which is one standard deviation of 5 from the paper.
    other = LIKE_THE_PAPER.copy()
    other[3] = [0, 3, 3, 9, 5, 0]
    tried = [trial_of(LIKE_THE_PAPER), trial_of(other)]
    assert calibrate.shortfall(tried, PAPER) == pytest.approx((1.0, 5 / len(PAPER.cells)))


CANDIDATES = [{"part.size": 1.5}, {"part.size": 2.5}, {"part.size": 3.5}]
SEEDS = [7, 8, 9]


def make(values, seeds):
    """Yield trials that contain their own arguments."""
    for candidate, seed in zip(values, seeds, strict=True):
        yield {"archive_seed": seed, "confusion": "[]"} | candidate


def test_trials_are_made_once_and_then_read_and_only_what_is_missing_is_made(tmp_path):
    path, asked = tmp_path / "new/log.csv", []

    def note(values, seeds):
        asked.extend(seeds)
        return make(values, seeds)

    # Every trial is in the file before the next is asked for.
    def interrupted(values, seeds):
        yield next(make(values, seeds))
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        TrialLog(path, interrupted).trials("first", CANDIDATES, SEEDS)
    assert [row["archive_seed"] for row in read_csv(path)] == ["7"]
    log = TrialLog(path, note)
    made = log.trials("first", CANDIDATES, SEEDS)
    assert asked == SEEDS[1:]
    log.trials("second", CANDIDATES, SEEDS)
    assert [row["stage"] for row in read_csv(path)] == 3 * ["first"] + 3 * ["second"]
    known = TrialLog(path, note).trials("first", CANDIDATES, SEEDS)
    assert asked == [*SEEDS[1:], *SEEDS]
    assert known == [{name: str(value) for name, value in trial.items()} for trial in made]
    assert known == read_csv(path)[:3]
    # Trials of another value, parameter or archive, and fewer trials, are refused.
    before, other = path.read_bytes(), [{"part.size": 9.5}, *CANDIDATES[1:]]
    for candidates, seeds in (
        (other, SEEDS), ([{"part.other": 1.5}] * 3, SEEDS), (CANDIDATES, [7, 8, 10]),
        (CANDIDATES[:2], SEEDS[:2]),
    ):  # fmt: skip
        with pytest.raises(CapsuleError, match=r"log\.csv: first has other candidates than this"):
            TrialLog(path, make).trials("first", candidates, seeds)
    assert path.read_bytes() == before
