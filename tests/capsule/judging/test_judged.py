"""capsule judge: any file judged, in words, as JSON and as a picture."""

import json
import os
import re
import shutil
from dataclasses import replace

import numpy as np
import pytest

from capsule.detectors.base import NO_VERDICT, Verdict
from capsule.detectors.familiar import Familiarity
from capsule.engine.configuration import read_config_file
from capsule.engine.project import PROJECT
from capsule.errors import CapsuleError
from capsule.judging.judged import (
    JudgedFile,
    as_plain_values,
    judge_file,
    judged_lines,
    places_s,
    taught_recordings,
    write_picture,
)
from capsule.judging.verdict import FinalVerdict, Judgement
from capsule.phantom.files import DEFAULT_TABLE, read_phantom
from capsule.phantom.simulation import recording_of, simulate_run
from capsule.recordings.acceptance import check_recording
from capsule.recordings.recording import Recording, format_recording
from support.command import run_command
from support.learned import taught_by, write_learned

CONFIGURATION = read_config_file(PROJECT / "config/config.yaml")


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    """Make the results that judging needs, and a recording."""
    folder = tmp_path_factory.mktemp("results")
    write_learned(folder, CONFIGURATION, taught_by())
    phantom = read_phantom(DEFAULT_TABLE, [])
    run = simulate_run(phantom, 4.0, 1, "4mm/r01")
    (folder / "run.csv").write_bytes(format_recording(recording_of(run, phantom, 1, "4mm/r01")))
    return folder


@pytest.fixture(scope="module")
def final(results):
    return FinalVerdict(results / "templates.npz", results / "detectors.json", CONFIGURATION)


@pytest.fixture(scope="module")
def judged(results, final):
    return judge_file(results / "run.csv", final, {})


def test_labelled_recordings_that_changed_since_the_detectors_learned_are_named(
    results, tmp_path, capsys
):
    shutil.copytree(results, tmp_path / "results")
    table, patient = tmp_path / "results/recordings.csv", tmp_path / "raw/unlabelled/patient.csv"
    patient.parent.mkdir(parents=True)
    patient.write_text("new")
    words = ["judge", results / "run.csv", "--results", tmp_path / "results"]
    table.write_text("recording,sha256,status\n")
    run_command(*words)
    assert capsys.readouterr().err == ""
    table.write_text("recording,sha256,status\n3mm/r01,00,rejected\n")
    run_command(*words)
    assert "note: 1 labelled recording came, went or changed" in capsys.readouterr().err
    table.write_bytes(b"\xff\x00")
    with pytest.raises(CapsuleError, match=r"recordings\.csv is damaged .* snakemake -c2"):
        run_command(*words)


def test_the_command_tells_verdicts_place_and_what_is_wrong_with_a_file(
    results, capsys, monkeypatch
):
    monkeypatch.setenv("COLUMNS", "60")
    (results / "cut.csv").write_text("time_s,sensor_1\n0,1\n")
    files = [results / name for name in ("run.csv", "cut.csv", "none.csv")]
    assert run_command("judge", "--results", results, *files) == 1
    *accepted, cut, missing = capsys.readouterr().out.splitlines()
    assert accepted[0].endswith("simulated phantom, version 5, seed 1")
    assert not accepted[1].isascii()
    # A line fits a terminal that has 60 columns and breaks a line that fills them.
    assert len(accepted[1]) == 59
    assert "is like the recordings that teach is not known: only " in accepted[7]
    detectors = CONFIGURATION["detectors"]
    assert [line.split()[0] for line in accepted[9 : 9 + len(detectors)]] == detectors
    assert cut.startswith(f"{files[1]}: rejected: line 1: the column 'sensor_2' is missing")
    assert missing == f"{files[2]}: rejected: it cannot be read: No such file or directory"


@pytest.mark.parametrize(
    ("words", "reason"),
    [
        (["run.csv", "--results", "none"], "a verdict needs none/templates.npz; make it first"),
        (["a.csv", "b.csv", "--picture", "p.png"], "--picture draws one recording"),
        (["a.csv", "--picture", "p.pdf"], "the name must end in .png or .svg"),
    ],
)
def test_what_the_command_cannot_do_is_refused_at_once(words, reason):
    with pytest.raises(CapsuleError, match=re.escape(reason)):
        run_command("judge", *words)


@pytest.mark.parametrize(
    ("familiarity", "probability"),
    [
        (Familiarity(None), 0.987),
        (Familiarity(True), 0.987),
        (Familiarity(False, ("period_s",), 6.4, 3.2, 3.3), None),
    ],
)
def test_a_strange_file_says_so_and_has_no_probability(judged, familiarity, probability):
    verdicts = {"one": replace(verdict_at(50.0), probability=0.987)}
    lines = "\n".join(shown(verdicts, 60, familiarity))
    assert ("98.7 %" in lines) == (probability is not None)
    judgement = Judgement(CONFIGURATION, verdicts, familiarity)
    values = as_plain_values(replace(judged, judgement=judgement))
    said = values["familiar"], values["verdicts"]["one"]["probability"]
    assert said == (familiarity.familiar, probability)
    for text in (lines, values["unfamiliar_because"]):
        assert ("6.40 s, but 3.20 to 3.30 s" in text) == (familiarity.familiar is False)


def test_json_alone_is_printed_where_it_is_asked_for_and_a_rejected_file_is_not_drawn(
    results, judged, capsys, tmp_path
):
    options = "judge", "--results", results, "--json", "--picture"
    assert run_command(*options, tmp_path / "run.png", results / "run.csv") == 0
    assert (tmp_path / "run.png").read_bytes().startswith(b"\x89PNG")
    (values,) = json.loads(capsys.readouterr().out)
    assert values == as_plain_values(judged)
    said, verdict = values["verdicts"]["diagonal"], judged.judgement.verdicts["diagonal"]
    assert (said["location_s"], said["distances"]) == (verdict.location_samples / 10, [])
    assert values["verdicts"]["template"]["probability"] is None
    assert run_command(*options, tmp_path / "cut.png", results / "none.csv") == 1
    assert not (tmp_path / "cut.png").exists()


def test_a_rejected_file_tells_the_workflows_own_reason(tmp_path, final):
    def reason_of(path):
        (line,) = judged_lines(judge_file(path, final, {}), 80)
        return line.removeprefix(f"{path}: rejected: ")

    path = tmp_path / "file.csv"
    for data in (b"time_s;sensor_1\n0;1\n", bytes(17_000_000)):
        path.write_bytes(data)
        own = check_recording("file", data, 16_000_000, CONFIGURATION)[0]["reason"]
        # Here the import that could read the file is named by the file's own path.
        assert reason_of(path).partition(": capsule import ")[0] == own.partition(": capsule im")[0]
    # What is no file is not waited for.
    os.mkfifo(tmp_path / "pipe.csv")
    assert reason_of(tmp_path / "pipe.csv").startswith("it cannot be read: ")


# Kills: a held-out recording, or a rejected one, of which the note says that it taught.
def test_a_recording_that_taught_the_detectors_is_named(judged, tmp_path):
    (tmp_path / "recordings.csv").write_text(
        "recording,readings_sha256,session,status,no_verdict,size_mm\n"
        "4mm/r01,its sum,monday,accepted,,4\n"
        "4mm/h01,a,tuesday,accepted,,4\n"
        "4mm/r02,b,monday,rejected,,4\n"
        "4mm/r03,c,monday,accepted,no wave on sensor 2,4\n"
        "unlabelled/x,d,monday,accepted,,\n"
    )
    taught = taught_recordings(tmp_path / "recordings.csv", ["tuesday"])
    assert taught == {"its sum": "4mm/r01"}
    *_, note = judged_lines(replace(judged, taught_as="4mm/r01"), 80)
    assert "learned from this very recording (4mm/r01)" in note
    assert "note" not in "".join(judged_lines(judged, 80))
    assert taught_recordings(tmp_path / "none.csv", []) == {}


def shown(verdicts, width, familiarity=None, *, plain=False):
    """Return the lines for a ramp of 100 samples with a gap, with these verdicts."""
    values = np.tile(np.arange(100.0), (2, 1))
    values[1, 50:] = np.nan
    check = {
        "status": "accepted",
        "header": {},
        "no_verdict": "",
        "samples": 100,
        "duration_s": 9.9,
    }
    judgement = Judgement(CONFIGURATION, verdicts, familiarity or Familiarity(True))
    return judged_lines(JudgedFile("a.csv", check, values, judgement, ""), width, plain=plain)


def verdict_at(samples):
    return Verdict(3.0, 2.0, 1.0, estimate_mm=3.0, location_samples=samples)


def test_a_header_moves_no_cursor_of_the_terminal(judged):
    text, told = "\x1b[31mred\x07 r01\u202egpj.exe", "\\x1b[31mred\\x07 r01\\u202egpj.exe"
    check = judged.check | {"header": {"source": text}}
    moved = replace(judged, check=check, file=f"{text}.csv")
    title = judged_lines(moved, 80)[0]
    assert title.startswith(f"{told}.csv: ") and title.endswith(told)
    rejected = replace(moved, check=check | {"status": "rejected", "reason": "torn"})
    assert judged_lines(rejected, 80) == [f"{told}.csv: rejected: torn"]


def test_the_plot_marks_each_place_below_the_sensors():
    verdicts = {"one": verdict_at(50.0), "two": verdict_at(90.0), "three": verdict_at(50.0)}
    title, first, second, marks, named, *_ = shown(verdicts, 9 + 20)
    assert title == "a.csv: 100 samples, 9.9 s, source not given"
    assert first.removeprefix("sensor 1 ") == "▁▁▁▂▂▂▃▃▃▄▄▅▅▅▆▆▆▇▇█"
    assert second.removeprefix("sensor 2 ") == "▁▁▂▃▄▄▅▆▇█"
    assert marks.removeprefix("place    ") == " " * 10 + "a" + " " * 7 + "b"
    assert named.strip() == "a: one and three, b: two"
    ends = shown({"one": verdict_at(0.0), "two": verdict_at(120.0)}, 9 + 20)
    assert ends[3] == f"place    a{'b':>19}"
    # With a cell for each sample, none is empty.
    assert len(shown(verdicts, 9 + 100)[1].replace(" ", "")) == len("sensor1") + 100


def test_a_place_before_the_start_and_no_verdict_are_said_in_words():
    verdicts = {"early": verdict_at(-3.0), "none": NO_VERDICT, "new": replace(NO_VERDICT, score=2)}
    lines = shown(verdicts, 60, plain=True)
    assert all(line.isascii() and not line.startswith("place  ") for line in lines)
    head, early, unknown, new = lines[3:7]
    assert early.startswith("early") and early.endswith("before the start")
    # The reason of one detector makes no column of the others wider.
    assert len(head) < len(unknown)
    assert "no verdict: no score: a wave" in unknown and "no verdict: no threshold: lab" in new


def test_noise_is_accepted_and_has_no_verdict(tmp_path, final):
    noise = np.random.default_rng(1).normal(500, 20, (4, 600)).round()
    content = format_recording(Recording(np.arange(600) / 10, noise, {}))
    (tmp_path / "noise.csv").write_bytes(content)
    judged = judge_file(tmp_path / "noise.csv", final, {})
    assert "no detector can judge it: no wave on sensor_1" in judged_lines(judged, 80)[-1]
    assert judged.is_accepted and not judged.judgement.verdicts


def test_the_picture_holds_a_mark_at_each_place(judged, tmp_path, monkeypatch):
    drawn = []
    renders = "capsule.figures.style.render_figure"
    monkeypatch.setattr(renders, lambda *drawing: drawn.append(drawing) or b"picture")
    write_picture(judged, tmp_path / "run.svg")
    ((figure, kind, name),) = drawn
    assert (kind, name) == ("svg", "run.csv, simulated")
    places = places_s(judged.judgement.verdicts, 10.0)
    signal, envelope, matrix = figure.axes[:3]
    for axes in (signal, envelope, matrix):
        marks = [line.get_xdata() for line in axes.lines if len(line.get_xdata()) == 2]
        assert [each[0] for each in marks if each[0] == each[1]] == list(places)
    named = [text.get_text() for text in signal.get_legend().get_texts()]
    marked = [f"place by {' and '.join(names)}: {place:.1f} s" for place, names in places.items()]
    assert named == [*marked, "the diagonal"]
    # One point at each sensor, from the place on; kills a diagonal that begins elsewhere.
    diagonal = matrix.lines[-1].get_xydata()
    assert diagonal[:, 1].tolist() == [1, 2, 3, 4]
    assert diagonal[0, 0] in places and (np.diff(diagonal[:, 0]) > 8).all()
