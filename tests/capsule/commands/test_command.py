"""The command capsule starts the right subcommand, in the folder that it is called in."""

import base64
import os
import re
import shutil
import signal
import subprocess
import sys

import pytest
import yaml

from capsule.commands import cli
from capsule.errors import CapsuleError
from support.command import CAPSULE, run_command
from support.project import ROOT
from support.synthetic import write_archive

pytestmark = pytest.mark.takes(0.3)


def call(*words, program=CAPSULE, **settings):
    return subprocess.run([*program, *map(str, words)], capture_output=True, text=True, **settings)


def test_help_lists_the_commands_and_imports_nothing_heavy():
    python, package = CAPSULE
    done = subprocess.run(
        [python, "-X", "importtime", package, "--help"], capture_output=True, text=True, check=True
    )
    assert re.findall(r"^    (\w+)(?:  +\w|$)", done.stdout, re.MULTILINE) == list(cli.COMMANDS)
    imported = {line.rpartition("|")[2].strip() for line in done.stderr.splitlines()}
    assert "capsule.commands.cli" in imported
    assert not {"numpy", "pandas", "serial", "yaml", "capsule.bench"} & imported


def test_the_version_says_where_the_code_is_and_without_a_word_the_help_is_an_error(tmp_path):
    environment = {**os.environ, "PYTHONPATH": str(ROOT / "workflow" / "scripts")}
    module = {"program": [sys.executable, "-m", "capsule"], "cwd": tmp_path, "env": environment}
    for called in ({}, module):
        told = call("--version", **called).stdout
        assert told == f"capsule 0.1.0, from {ROOT / 'workflow/scripts/capsule'}\n"
    done = call()
    assert (done.returncode, done.stdout.startswith("usage: capsule ")) == (2, True)


def test_a_wrong_word_is_answered_with_the_nearest(capsys):
    for word, hint in (("jugde", "did you mean 'judge'?"), ("xyz", "the commands are record,")):
        with pytest.raises(SystemExit) as ended:
            cli.main([word])
        assert ended.value.code == 2
        told = capsys.readouterr().err
        assert told.startswith(f"error: capsule has no command {word!r}; {hint}")


@pytest.mark.parametrize("word", cli.COMMANDS)
def test_a_command_is_called_by_its_name_and_leaves_ctrl_c_as_it_was(word, capsys):
    before = signal.getsignal(signal.SIGINT)
    with pytest.raises(SystemExit) as ended:
        cli.main([word, "--no-such-option"])
    assert ended.value.code == 2
    assert capsys.readouterr().err.startswith(f"usage: capsule {word} ")
    assert signal.getsignal(signal.SIGINT) is before


@pytest.fixture
def bench(tmp_path, monkeypatch):
    """Make the folder of a bench with three sensors, and go there."""
    run_command("new", tmp_path / "pig-7", "--sensors", 3)
    monkeypatch.chdir(tmp_path / "pig-7")
    return tmp_path / "pig-7"


def settings_of(folder):
    return yaml.safe_load((folder / "config/config.yaml").read_text(encoding="utf-8"))


def test_a_new_folder_holds_settings_raw_and_what_to_do_and_is_made_in_none_with_files(
    tmp_path, capsys
):
    folder = tmp_path / "pig-7"
    run_command("new", folder)
    assert "cd " in capsys.readouterr().out
    names = ["README.md", "Snakefile", "config", "profiles", "raw"]
    assert sorted(path.name for path in folder.iterdir()) == names
    assert (folder / "README.md").read_text(encoding="utf-8").startswith("# pig-7\n")
    assert settings_of(folder)["evaluation"]["held_out"] == []
    with pytest.raises(CapsuleError, match="is not empty; nothing was written"):
        run_command("new", tmp_path)
    assert list(tmp_path.iterdir()) == [folder]


# Kills: a text of the shipped configuration that is no longer found, and so not replaced.
@pytest.mark.parametrize(("sensors", "length"), [(2, 1000), (5, 1250)])
def test_another_number_of_sensors_sets_what_it_needs(tmp_path, sensors, length):
    run_command("new", tmp_path / "lab", "--sensors", sensors)
    settings = settings_of(tmp_path / "lab")
    assert settings["recording"]["sensors"] == sensors
    assert settings["preprocessing"]["length"] == length
    assert settings["detectors"] == ["template", "diagonal"]
    text = (tmp_path / "lab/config/config.yaml").read_text(encoding="utf-8")
    assert "docs/" not in text and "README" not in text
    with pytest.raises(CapsuleError, match="--sensors 0: give a number from 1 to 64"):
        run_command("new", tmp_path / "none", "--sensors", 0)


def test_simulate_import_and_record_write_into_the_folder_with_its_sensors(bench):
    run_command("simulate", "--runs", "1", "--sizes", "3")
    header = (bench / "raw/3mm/r01.csv").read_text(encoding="utf-8")
    assert "time_s,sensor_1,sensor_2,sensor_3\n" in header
    (bench / "raw/3mm/r01.csv").rename(bench / "other.csv")
    shutil.rmtree(bench / "raw")
    assert run_command("import", "other.csv", "--size", "2") == 0
    assert (bench / "raw/2mm/other.csv").is_file()
    done = call("record", "--size", "1", "--port", bench / "none", cwd=bench)
    assert done.returncode == 3


@pytest.mark.parametrize(
    "words", ["judge run.csv", "export --format mat", "simulate", "survey --simulate --out one"]
)
def test_each_command_checks_the_configuration_of_the_folder(bench, words):
    (bench / "config/config.yaml").write_text("recording: {sensors: four}\n", encoding="utf-8")
    with pytest.raises(CapsuleError, match=r"config/config\.yaml: "):
        run_command(*words.split())


@pytest.mark.slow
@pytest.mark.workflow
@pytest.mark.takes(12)
def test_a_bench_goes_on_after_a_kill_and_a_move_and_runs_no_file_of_its_folder(tmp_path):
    bench, check = tmp_path / "pig-7", "results/checks/0mm/r01.json"
    run_command("new", bench)
    write_archive(bench / "raw", ["0mm/r01", "3mm/r07"], samples=525)
    # `python -m` would import it before the library of this name.
    (bench / "yaml.py").write_text("raise SystemExit('this is no code of the project')\n")
    words = ["report", "--cores", "1", "--", "--until", "preprocess"]
    done = call(*words, cwd=bench)
    assert done.returncode == 0, done.stderr
    # What `kill -9` leaves: Snakemake's lock, and its note on a result that was under way.
    (bench / "yaml.py").unlink()
    noted = base64.b64encode(check.encode()).decode()
    for left in ("locks/0.output.lock", f"incomplete/{noted}"):
        (bench / ".snakemake" / left).parent.mkdir(exist_ok=True)
        (bench / ".snakemake" / left).write_text(f"{check}\n")
    plain = [sys.executable, "-m", "snakemake", "--cores=1", check]
    done = subprocess.run(plain, cwd=bench, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert "preprocess 0mm/r01" in done.stderr
    (tmp_path / "deep/er").mkdir(parents=True)
    moved = bench.rename(tmp_path / "deep/er/pig-8")
    done = subprocess.run([*plain, "--dry-run"], cwd=moved, capture_output=True, text=True)
    assert "Nothing to be done" in done.stdout + done.stderr
