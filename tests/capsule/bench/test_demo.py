"""capsule demo: a simulated run without a board, recorded by the recorder of capsule record."""

import re
import signal
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from capsule.bench import demo_command, recorder
from capsule.commands.report import call_workflow
from capsule.engine.configuration import read_config_file
from capsule.engine.project import PROJECT
from capsule.errors import CapsuleError
from capsule.interface.archive import read_recording
from capsule.phantom.files import DEFAULT_TABLE, read_phantom
from capsule.phantom.simulation import simulate_run
from support.command import parsers
from support.learned import taught_by, write_learned, write_templates

PHANTOM = read_phantom(DEFAULT_TABLE, [])


def write_results(folder):
    folder.mkdir(exist_ok=True)
    write_templates(folder)
    write_learned(folder, read_config_file(PROJECT / "config/config.yaml"), taught_by())


@pytest.fixture
def workflow(monkeypatch):
    """Write what Snakemake makes, and keep its calls; it ends with `status`, learning first."""
    made = SimpleNamespace(calls=[], learning=0, status=0)

    def call(folder, arguments):
        made.calls.append(arguments)
        if not made.status:
            write_results(folder / "results")
        return made.status

    def learn(folder, arguments):
        if not made.learning:
            call(folder, arguments)
        return [sys.executable, "-c", f"raise SystemExit({made.learning})"]

    monkeypatch.setattr(demo_command, "LABELLED", {3.0: 2})
    monkeypatch.setattr(demo_command, "call_workflow", call)
    monkeypatch.setattr(demo_command, "snakemake_command", learn)
    monkeypatch.setattr(demo_command.webbrowser, "open", made.calls.append)
    return made


def play(folder):
    demo_command.demo(parsers()["demo"].parse_args(f"--out {folder} --speed 50 --cores 2".split()))


# Kills: verdicts that are lost with a learning that Ctrl-C has ended with the run.
@pytest.mark.parametrize("learning", [0, 130])
def test_the_demo_records_the_simulated_run_to_the_last_sample(workflow, tmp_path, capfd, learning):
    folder, former = tmp_path / "demo", signal.getsignal(signal.SIGINT)
    workflow.learning = learning
    play(folder)
    recording = read_recording(folder / "raw/unlabelled/simulated-2.csv", 4)
    assert (recording.values == simulate_run(PHANTOM, 3.0, 2, "simulated-2").counts).all()
    assert recording.header["source"] == "simulated phantom, played by the demo"
    assert recording.header["simulator_seed"] == "2"
    learned, report, page = workflow.calls
    assert learned == ["--cores=2", "results/templates.npz", "results/detectors.json"]
    assert report == ["--cores=2", "results/report.html"] and page.startswith("file:///")
    said = capfd.readouterr().out
    assert "ended: the capsule reached the end stop" in said
    assert said.rindex("\ntaught ") < said.index("The truth: a nodule of 3 mm")
    assert "The demo cannot open a browser" in said
    # The workflow has to hear Ctrl-C again.
    assert signal.getsignal(signal.SIGINT) is former


# Kills: a duration that is not kept; a header without the run's names; a check that is not told.
@pytest.mark.parametrize("noise", [False, True])
def test_a_run_is_recorded_for_a_duration_checked_and_judged(tmp_path, capsys, noise):
    counts = simulate_run(PHANTOM, 3.0, 3, "a run").counts
    if noise:
        counts = np.random.default_rng(1).integers(300, 700, (4, 700))
    write_results(tmp_path)
    words = f"--raw {tmp_path}/raw --logs {tmp_path} --templates {tmp_path}/templates.npz --size 3"
    words += " --session monday --site A --setup gut-2 --detect --duration 53"
    run = demo_command.PlayedRun(counts, PHANTOM, 2, 100.0)
    path = recorder.record(parsers()["record"].parse_args(words.split()), run)
    assert path.parent.name == "3mm"
    recording = read_recording(path, 4)
    np.testing.assert_array_equal(recording.values, counts[:, :530])
    expected = {"session": "monday", "site": "A", "setup": "gut-2", "simulator_seed": "2"}
    assert expected.items() <= recording.header.items()
    printed, _, told = capsys.readouterr().out.partition("archived ")
    assert "ended: --duration is over" in printed and "00:53.0 of 00:53.0" in told
    assert ("\ntaught " in told, "no detector will judge" in told) == (not noise, noise)


def test_each_demo_plays_another_run_beside_those_before(tmp_path):
    for name in ("raw/unlabelled/simulated-2.csv", "played/unlabelled/simulated-3.csv.part"):
        (tmp_path / name).parent.mkdir(parents=True)
        (tmp_path / name).touch()
    assert demo_command.next_seed(tmp_path) == 4


@pytest.mark.parametrize("make", [lambda path: (path / "raw").mkdir(parents=True), Path.touch])
def test_a_folder_of_somebody_is_left_alone(workflow, tmp_path, make):
    make(tmp_path / "mine")
    before = list(tmp_path.rglob("*"))
    with pytest.raises(CapsuleError, match=r"mine exists and was not made by a demo; .* --out"):
        play(tmp_path / "mine")
    assert not workflow.calls
    assert list(tmp_path.rglob("*")) == before


def test_a_workflow_that_fails_ends_the_demo(workflow, tmp_path):
    workflow.status = 1
    with pytest.raises(CapsuleError, match=r"ended with status 1; the recordings .*demo/raw\. To"):
        play(tmp_path / "demo")


@pytest.mark.boards
def test_the_workflow_reads_the_demos_folder_and_no_other(tmp_path, monkeypatch, capfd):
    folder = tmp_path / "demo"
    demo_command.prepare(folder, PHANTOM, 4)
    shipped = read_config_file(PROJECT / "config/config.yaml")
    shipped["evaluation"]["held_out"] = []
    assert read_config_file(folder / "config/config.yaml") == shipped, "no shipped recordings"
    monkeypatch.chdir(tmp_path)
    assert call_workflow(folder, ["--cores=1", "results/report.html", "--dry-run"]) == 0
    jobs = re.findall(r"^ *preprocess +(\d+) *$", "".join(capfd.readouterr()), re.MULTILINE)
    assert set(jobs) == {str(sum(demo_command.LABELLED.values()))}
    assert not (tmp_path / "results").exists()
