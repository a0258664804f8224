"""capsule record --detect: the running verdicts, and the verdicts of all detectors at the end."""

import json
import re
from functools import partial

import numpy as np
import pytest

from capsule.detectors import files as detectors_files
from capsule.detectors.base import Verdict
from capsule.detectors.familiar import LEAST_PLACES, Familiarity
from capsule.engine.configuration import read_config_file
from capsule.engine.project import PROJECT
from capsule.errors import CapsuleError
from capsule.judging.verdict import FinalVerdict, Judgement
from capsule.phantom.files import DEFAULT_TABLE, read_phantom
from capsule.phantom.simulation import simulate_run
from support.learned import healthy_runs, taught_by, teach_familiar, write_learned

HEADER = {"adc_bits": "10"}
CONFIGURATION = read_config_file(PROJECT / "config/config.yaml")


def final_in(folder):
    return FinalVerdict(folder / "templates.npz", folder / "detectors.json", CONFIGURATION)


@pytest.fixture
def final(tmp_path):
    """Make detectors that have learned from a few passages, with templates of one size, 3 mm."""
    write_learned(tmp_path, CONFIGURATION, taught_by())
    return final_in(tmp_path)


def samples_of(values):
    return [tuple(sample) for sample in values.astype(int).T.tolist()]


NOISE = np.random.default_rng(2).normal(500, 20, (4, 700)).round()
# Over 5 mm the capsule may be held until the run is stopped by hand.
RUN = samples_of(simulate_run(read_phantom(DEFAULT_TABLE, []), 4.0, 1, "4mm/r01").counts)


@pytest.mark.parametrize("samples", [RUN[:200], RUN, [*RUN[:300], *[None] * 10, *RUN[310:]]])
def test_a_run_is_judged_as_if_it_ended_now(final, samples):
    so_far = final.judge_so_far(samples, HEADER)
    title, *table = so_far.lines_so_far()
    assert title == "if the run ended now:"
    values = np.array([[np.nan] * 4 if sample is None else sample for sample in samples])
    assert table == final.judge(values.T.astype(float)).table()
    assert [line.split()[0] for line in table[2:]] == CONFIGURATION["detectors"]
    assert [each["detector"] for each in so_far.scores] == CONFIGURATION["detectors"]


# Kills: a run that has just begun is said to have 0 samples, as if something had failed.
@pytest.mark.parametrize(
    ("samples", "reason"),
    [
        ([], r"the detectors judge from 8 s on$"),
        (RUN[:83], r"the detectors judge from 8 s on$"),
        (RUN * 2, r"no verdict yet: .*preprocessing\.length"),
        ([(5, *sample[1:]) for sample in RUN], "no verdict yet: sensor_1 reads 5 in all sampl"),
        ([*RUN[:200], *[None] * 100, *RUN[200:]], "no verdict yet: .*missing for 10 s"),
        ([None] * 100, "no verdict yet: .*missing for 10 s"),
        (samples_of(NOISE), "no verdict yet: no wave on sensor_1 and "),
    ],
)
def test_without_a_verdict_so_far_there_is_its_reason(final, samples, reason):
    so_far = final.judge_so_far(samples, HEADER)
    assert re.match(reason, so_far.advice)
    assert so_far.lines_so_far() == [so_far.advice]


@pytest.mark.parametrize(
    ("scores", "advice"),
    [((2, 3), "enough: nodule"), ((0, 0.5), "enough: no nodule"), ((2, 0), "pass again: ")],
)
def test_it_is_enough_if_all_say_the_same_and_no_probability_is_told_as_certain(scores, advice):
    said = {f"{each}": Verdict(float(each > 1), each, 1.0, 0.99999) for each in scores}
    judgement = Judgement(CONFIGURATION, said, Familiarity(True))
    assert judgement.advice.startswith(advice)
    assert "  > 99.9 % " in f"{judgement.table()[1]} "


def test_a_run_of_another_kind_is_told_before_the_verdicts(tmp_path):
    write_learned(tmp_path, CONFIGURATION, taught_by())
    teach_familiar(tmp_path, healthy_runs(LEAST_PLACES), CONFIGURATION)
    final = final_in(tmp_path)
    run = simulate_run(read_phantom(DEFAULT_TABLE, []), 4.0, 2, "4mm/r01").counts.astype(float)
    usual, slow = (final.judge(each) for each in (run, np.repeat(run, 2, axis=1)[:, :900]))
    assert usual.lines()[0].startswith("detector ")
    assert slow.lines()[0].startswith("unlike the recordings that teach: ")
    assert slow.advice.startswith("seat the capsule anew: ")
    *_, by_diagonal, _, meant = usual.lines()
    assert re.fullmatch(r"diagonal .* [\d.]+ % +[\d.]+ s, [\d.]+ mm", by_diagonal)
    assert "if 10 % of all recordings have one" in meant
    assert not any(" %" in line for line in slow.lines()[-4:-1])


def rewrite(folder, lacking="", **changes):
    """Write what was learned without some entry or with others, and its checksum."""
    path = folder / "detectors.json"
    content = {
        key: value
        for key, value in (json.loads(path.read_text()) | changes).items()
        if key not in ("checksum", lacking)
    }
    path.write_text(json.dumps(content | {"checksum": detectors_files._checksum(content)}))


# Kills: a KeyError in place of a line that names the file and the remedy.
@pytest.mark.parametrize(
    ("spoil", "told"),
    [
        (lambda to: (to / "templates.npz").unlink(), r"templates\.npz; make it first"),
        (lambda to: (to / "detectors.json").unlink(), r"detectors\.json; make it first"),
        (lambda to: write_learned(to, CONFIGURATION, taught_by(), dwell=99), "another config"),
        (lambda to: rewrite(to, scorer="of others"), "another configuration or version"),
        (lambda to: (to / "detectors.json").write_text("{}"), "damaged, or of another version"),
        (lambda to: np.savez(to / "templates.npz", x=np.ones((4, 1000))), "not made together"),
        (partial(rewrite, lacking="templates"), "not made together"),
        (partial(rewrite, lacking="scorer"), "another configuration or version"),
        (partial(rewrite, lacking="familiar"), "another configuration or version"),
        (partial(rewrite, lacking="settings"), r"detectors\.json "),
    ],
)
@pytest.mark.usefixtures("final")
def test_what_was_learned_elsewhere_or_not_is_refused_with_the_remedy(tmp_path, spoil, told):
    spoil(tmp_path)
    with pytest.raises(CapsuleError, match=f"{told}.*snakemake -c2"):
        final_in(tmp_path)


@pytest.mark.parametrize("name", ["templates.npz", "detectors.json"])
@pytest.mark.usefixtures("final")
def test_damage_anywhere_in_what_was_learned_is_one_error_with_the_remedy(name, tmp_path):
    whole, random = (tmp_path / name).read_bytes(), np.random.default_rng(1)
    for _ in range(100):
        damaged = bytearray(whole)
        damaged[random.integers(len(whole))] ^= 1 << random.integers(8)
        damaged = damaged[: random.integers(1, len(whole))] if random.random() < 0.3 else damaged
        (tmp_path / name).write_bytes(damaged)
        with pytest.raises(CapsuleError, match="snakemake -c2"):
            final_in(tmp_path)
