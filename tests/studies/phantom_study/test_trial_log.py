"""The log of trials: no trial is made twice, and the log of another search is refused."""

import pytest
from phantom_study.calibrate import TrialLog

from capsule.errors import CapsuleError
from capsule.store.files import read_csv

CANDIDATES = [{"part.size": 1.5}, {"part.size": 2.5}, {"part.size": 3.5}]
SEEDS = [7, 8, 9]


def make(values, seeds):
    """Yield trials that contain their own arguments."""
    for candidate, seed in zip(values, seeds, strict=True):
        yield {"archive_seed": seed, "confusion": "[]"} | candidate


def test_trials_are_made_once_and_then_read_and_only_what_is_missing_is_made(tmp_path):
    path = tmp_path / "new/log.csv"
    asked = []

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


@pytest.mark.parametrize(
    ("candidates", "seeds"),
    [
        ([{"part.size": 9.5}, *CANDIDATES[1:]], SEEDS),
        ([{"part.other": 1.5}] * 3, SEEDS),
        (CANDIDATES, [7, 8, 10]),
        (CANDIDATES[:2], SEEDS[:2]),
    ],
    ids=["another value", "another parameter", "another archive", "fewer trials"],
)
def test_trials_of_other_candidates_are_refused(tmp_path, candidates, seeds):
    path = tmp_path / "log.csv"
    TrialLog(path, make).trials("first", CANDIDATES, SEEDS)
    before = path.read_bytes()
    with pytest.raises(CapsuleError, match=r"log\.csv: first has other candidates than this"):
        TrialLog(path, make).trials("first", candidates, seeds)
    assert path.read_bytes() == before


def test_another_table_is_no_log(tmp_path):
    path = tmp_path / "cells.csv"
    path.write_text("cell,paper\nspecificity,30\n", encoding="utf-8")
    with pytest.raises(CapsuleError, match=r"cells\.csv: this is not a log of trials"):
        TrialLog(path, make)
