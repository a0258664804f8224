"""capsule record --detect: the running verdicts, and the verdicts of all detectors at the end."""

import json
import re

import numpy as np
import pytest

from capsule.detectors import files as detectors_files
from capsule.detectors.base import Verdict
from capsule.detectors.diagonal import Diagonal
from capsule.detectors.familiar import LEAST_PLACES, Familiarity
from capsule.engine.configuration import read_config_file
from capsule.engine.project import PROJECT
from capsule.errors import CapsuleError
from capsule.judging.verdict import FinalVerdict, Judgement
from capsule.phantom.files import DEFAULT_TABLE, read_phantom
from capsule.phantom.simulation import simulate_run
from support.learned import (
    healthy_runs,
    taught_by,
    teach_familiar,
    write_learned,
    write_templates,
)

HEADER = {"adc_bits": "10"}


@pytest.fixture
def templates(tmp_path):
    """Make templates of one size, 3 mm."""
    write_templates(tmp_path)


@pytest.fixture
def running(tmp_path, templates, configuration):
    """Make a running verdict whose detectors have learned from a few passages."""
    final = final_verdict(tmp_path, configuration, taught_by())
    return final


def run_of_waves(bumps):
    random = np.random.default_rng(1)
    phase = np.arange(700) / 32 - 6.3 / 80 * np.arange(4)[:, np.newaxis]
    values = random.normal(500, 2, (4, 700)) + 3 * np.sin(2 * np.pi * phase)
    for sensor in range(4 if bumps else 0):
        values[sensor, 150 + 100 * sensor : 250 + 100 * sensor] += random.normal(0, 60, 100)
    return [tuple(sample) for sample in values.round().astype(int).T.tolist()]


def simulated_run(size_mm):
    run = simulate_run(read_phantom(DEFAULT_TABLE, []), size_mm, 1, f"{size_mm:g}mm/r01")
    return run, [tuple(sample) for sample in run.counts.T.tolist()]


def test_a_run_is_judged_as_if_it_ended_now(running, tmp_path, configuration):
    _, samples = simulated_run(4.0)
    final = final_verdict(tmp_path, configuration, taught_by())
    for count in (200, len(samples)):
        so_far = running.judge_so_far(samples[:count], HEADER)
        title, *table = so_far.lines_so_far()
        assert title == "if the run ended now:"
        values = np.array(samples[:count], float).T
        assert table == final.judge(values).table()
        assert [line.split()[0] for line in table[2:]] == configuration["detectors"]
        assert [each["detector"] for each in so_far.scores] == configuration["detectors"]


def test_the_verdict_of_the_papers_detector_follows_the_run(running):
    line = running.judge_so_far(run_of_waves(bumps=True), HEADER).lines_so_far()[3]
    assert re.fullmatch(r"template +nodule +3\.0 mm +not given +[\d.]+ s", line)
    line = running.judge_so_far(run_of_waves(bumps=False), HEADER).lines_so_far()[3]
    assert re.fullmatch(r"template +no nodule +not given", line)


def test_verdict_passes_over_missing_samples(running):
    samples = run_of_waves(bumps=True)
    samples[300:310] = [None] * 10
    assert running.judge_so_far(samples, HEADER).lines_so_far()[3].split()[:4] == [
        "template",
        "nodule",
        "3.0",
        "mm",
    ]


def test_noise_has_no_verdict(running):
    noise = np.random.default_rng(2).normal(500, 20, (4, 700)).round().astype(int)
    so_far = running.judge_so_far([tuple(sample) for sample in noise.T.tolist()], HEADER)
    assert so_far.advice.startswith("no verdict yet: no wave on sensor_1 and ")


def test_no_verdict_without_reason(running, tmp_path, configuration):
    run = run_of_waves(bumps=True)

    def reason(samples):
        (said,) = running.judge_so_far(samples, HEADER).lines_so_far()
        return said.removeprefix("no verdict yet: ")

    # Kills: a run that has just begun is said to have 0 samples, as if something had failed.
    assert reason([]) == reason(run[:83]) == "the detectors judge from 8 s on"
    assert "preprocessing.length" in reason(run * 2)
    assert reason([(5, *sample[1:]) for sample in run]).startswith("sensor_1 reads 5 in all sampl")
    assert "missing for 10 s" in reason([*run[:200], *[None] * 100, *run[200:]])
    assert "missing for 10 s" in reason([None] * 100)
    with pytest.raises(CapsuleError, match="snakemake"):
        FinalVerdict(tmp_path / "none.npz", tmp_path / "detectors.json", configuration)


def test_what_is_learned_survives_the_file():
    for archive in (taught_by(), taught_by(healthy_scores=())):
        model = Diagonal.taught(archive)
        content = json.loads(json.dumps(model.stored(), allow_nan=False))
        read = Diagonal.restored(content, archive.templates)
        assert read.stored() == model.stored()
        recording = archive.recordings["unlabelled/n"]
        np.testing.assert_equal(vars(read.verdict(recording)), vars(model.verdict(recording)))


@pytest.fixture
def configuration():
    return read_config_file(PROJECT / "config/config.yaml")


def final_verdict(tmp_path, configuration, archive, **changes):
    write_learned(tmp_path, configuration, archive, **changes)
    return FinalVerdict(tmp_path / "templates.npz", tmp_path / "detectors.json", configuration)


def test_every_detector_judges_a_whole_run(templates, tmp_path, configuration):
    final = final_verdict(tmp_path, configuration, taught_by())
    # Over 5 mm the capsule may be held until the run is stopped by hand.
    run = simulate_run(read_phantom(DEFAULT_TABLE, []), 4.0, 1, "4mm/r01")
    lines = final.judge(run.counts.astype(float)).lines()
    unknown, _, by_rule, by_diagonal, by_taught, meant = lines
    assert unknown.startswith("whether it is like the recordings that teach is not known: only ")
    assert by_taught.startswith("taught ")
    assert re.match(r"template +n", by_rule)
    found = re.fullmatch(
        r"diagonal +(?:nodule|uncertain: pass again) +"
        r"(\d\.\d) mm \((\d\.\d) mm or more\) +[\d.]+ % +([\d.]+) s, ([\d.]+) mm",
        by_diagonal,
    )
    assert meant.endswith("probability: of a nodule, if 10 % of all recordings have one")
    assert float(found[2]) <= float(found[1])
    assert float(found[4]) == pytest.approx(run.nodule_at_mm, abs=4)


def test_a_probability_is_never_told_as_certain(configuration):
    verdicts = {"diagonal": Verdict(0.0, 9.0, 1.0, 0.99999)}
    _, told = Judgement(configuration, verdicts, Familiarity(True)).table()
    assert told.endswith("> 99.9 %")


def test_the_final_verdict_says_why_there_is_none(templates, tmp_path, configuration):
    final = final_verdict(tmp_path, configuration, taught_by(healthy_scores=()))
    noise = np.random.default_rng(1).normal(500, 2, (4, 700))
    *_, by_diagonal, by_taught, _ = final.judge(noise).lines()
    assert re.match("taught +no verdict: no score", by_taught)
    assert re.match("diagonal +no verdict: no threshold: labelled", by_diagonal)


def test_a_run_of_another_kind_is_told_before_the_verdicts(templates, tmp_path, configuration):
    phantom = read_phantom(DEFAULT_TABLE, [])
    write_learned(tmp_path, configuration, taught_by())
    teach_familiar(tmp_path, healthy_runs(LEAST_PLACES), configuration)
    path = tmp_path / "detectors.json"
    final = FinalVerdict(tmp_path / "templates.npz", path, configuration)
    run = simulate_run(phantom, 4.0, 2, "4mm/r01").counts.astype(float)
    head, *verdicts, _ = final.judge(run).lines()
    assert head.split()[0] == "detector"
    assert len(verdicts) == len(configuration["detectors"])
    assert any(" %" in line for line in verdicts)
    slow = np.repeat(run, 2, axis=1)[:, :900]
    first, _, *verdicts, _ = final.judge(slow).lines()
    assert first.startswith("unlike the recordings that teach: ")
    assert len(verdicts) == len(configuration["detectors"])
    assert not any(" %" in line for line in verdicts)


def test_what_was_learned_elsewhere_is_refused_with_the_remedy(templates, tmp_path, configuration):
    with pytest.raises(CapsuleError, match=r"detectors\.json; make it first: snakemake"):
        FinalVerdict(tmp_path / "templates.npz", tmp_path / "detectors.json", configuration)
    with pytest.raises(CapsuleError, match=r"another configuration .* snakemake -c2"):
        final_verdict(tmp_path, configuration, taught_by(), dwell=99)
    (tmp_path / "detectors.json").write_text("{}")
    with pytest.raises(CapsuleError, match="damaged, or of another version; delete it"):
        FinalVerdict(tmp_path / "templates.npz", tmp_path / "detectors.json", configuration)


def test_what_another_scorer_was_adapted_by_is_refused(
    templates, tmp_path, configuration, monkeypatch
):
    (tmp_path / "other.npz").write_bytes(b"other weights")
    with monkeypatch.context() as patch:
        patch.setattr(detectors_files, "WEIGHTS", tmp_path / "other.npz")
        write_learned(tmp_path, configuration, taught_by())
    with pytest.raises(CapsuleError, match=r"or version; make it again: snakemake -c2"):
        FinalVerdict(tmp_path / "templates.npz", tmp_path / "detectors.json", configuration)


def test_templates_of_another_moment_are_refused(templates, tmp_path, configuration):
    write_learned(tmp_path, configuration, taught_by())
    np.savez(tmp_path / "templates.npz", **{"0mm": np.zeros((4, 1000)), "2mm": np.ones((4, 1000))})
    with pytest.raises(CapsuleError, match=r"were not made together, .*: snakemake -c2"):
        FinalVerdict(tmp_path / "templates.npz", tmp_path / "detectors.json", configuration)


@pytest.mark.parametrize("name", ["templates.npz", "detectors.json"])
def test_damage_anywhere_in_what_was_learned_is_one_error_with_the_remedy(
    name, templates, tmp_path, configuration
):
    write_learned(tmp_path, configuration, taught_by())
    whole, random = (tmp_path / name).read_bytes(), np.random.default_rng(1)
    for _ in range(100):
        damaged = bytearray(whole)
        damaged[random.integers(len(whole))] ^= 1 << random.integers(8)
        damaged = damaged[: random.integers(1, len(whole))] if random.random() < 0.3 else damaged
        (tmp_path / name).write_bytes(damaged)
        with pytest.raises(CapsuleError, match="snakemake -c2"):
            FinalVerdict(tmp_path / "templates.npz", tmp_path / "detectors.json", configuration)


def test_an_unknown_detector_is_refused_with_the_known_ones(templates, tmp_path, configuration):
    unknown = configuration | {"detectors": ["template", "nearest"]}
    with pytest.raises(CapsuleError, match="no detector nearest; allowed are: template, "):
        final_verdict(tmp_path, unknown, taught_by())


# Kills: a KeyError in place of a line that names the file and the remedy.
@pytest.mark.parametrize("lacking", ["templates", "scorer", "familiar", "settings"])
def test_what_an_older_version_learned_is_refused_with_the_remedy(
    templates, tmp_path, configuration, lacking
):
    path = tmp_path / "detectors.json"
    write_learned(tmp_path, configuration, taught_by())
    content = json.loads(path.read_text())
    del content["checksum"], content[lacking]
    path.write_text(json.dumps(content | {"checksum": detectors_files._checksum(content)}))
    with pytest.raises(CapsuleError, match=r"detectors\.json .* snakemake -c2"):
        FinalVerdict(tmp_path / "templates.npz", path, configuration)
