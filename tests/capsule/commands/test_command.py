"""The command capsule starts the right subcommand, in the folder that it is called in."""

import os
import re
import signal
import subprocess
import sys
from unittest.mock import MagicMock

import pytest

from capsule.commands import cli, new, report
from capsule.engine.configuration import read_config_file
from capsule.engine.project import PROJECT
from capsule.errors import CapsuleError
from support.command import CAPSULE, run_command
from support.project import ROOT
from support.synthetic import write_archive

pytestmark = pytest.mark.takes(0.3)


def call(*words, **settings):
    return subprocess.run(words, capture_output=True, text=True, **settings)


def test_help_lists_the_commands_and_imports_nothing_heavy():
    python, package = CAPSULE
    done = call(python, "-X", "importtime", package, "--help")
    assert re.findall(r"^    (\w+)(?:  +\w|$)", done.stdout, re.MULTILINE) == list(cli.COMMANDS)
    imported = {line.rpartition("|")[2].strip() for line in done.stderr.splitlines()}
    assert "capsule.commands.cli" in imported
    assert not {"numpy", "pandas", "serial", "yaml", "capsule.bench"} & imported


def test_the_version_says_where_the_code_is(tmp_path):
    environment = {**os.environ, "PYTHONPATH": str(ROOT / "workflow" / "scripts")}
    for program in (CAPSULE, [sys.executable, "-m", "capsule"]):
        told = call(*program, "--version", cwd=tmp_path, env=environment).stdout
        assert told == f"capsule 0.1.0, from {ROOT / 'workflow/scripts/capsule'}\n"


def test_a_wrong_call_is_answered_and_leaves_ctrl_c_as_it_was(capsys):
    before = signal.getsignal(signal.SIGINT)
    for words, told in (
        ([], "usage: capsule [-h] [--version] COMMAND"),
        (["jugde"], "error: capsule has no command 'jugde'; did you mean 'judge'?"),
        (["xyz"], "error: capsule has no command 'xyz'; the commands are record,"),
        *(([word, "--no-such-option"], f"usage: capsule {word} ") for word in cli.COMMANDS),
    ):
        with pytest.raises(SystemExit) as ended:
            cli.main(words)
        printed = "".join(capsys.readouterr())
        assert (ended.value.code, printed[: len(told)]) == (2, told)
        assert signal.getsignal(signal.SIGINT) is before


def test_a_new_folder_has_settings_and_what_to_do_and_never_files_before(tmp_path):
    folder = tmp_path / "pig-7"
    run_command("new", folder)
    names = ["README.md", "Snakefile", "config", "profiles", "raw"]
    assert sorted(path.name for path in folder.iterdir()) == names
    assert (folder / "README.md").read_text().startswith("# pig-7\n")
    assert read_config_file(folder / "config/config.yaml")["evaluation"]["held_out"] == []
    # With the profile, a plain `snakemake` goes on after a kill.
    assert (folder / new.PROFILE).read_bytes() == (ROOT / new.PROFILE).read_bytes()
    with pytest.raises(CapsuleError, match="is not empty; nothing was written"):
        run_command("new", tmp_path)
    assert list(tmp_path.iterdir()) == [folder]


# Kills: a text of the shipped configuration that is no longer found, and so not replaced.
@pytest.mark.parametrize(("sensors", "length"), [(2, 1000), (5, 1250)])
def test_another_number_of_sensors_sets_what_it_needs(tmp_path, monkeypatch, sensors, length):
    run_command("new", lab := tmp_path / "lab", "--sensors", sensors)
    settings = read_config_file(config := lab / "config/config.yaml")
    told = settings["recording"]["sensors"], settings["preprocessing"]["length"]
    assert (told, settings["detectors"]) == ((sensors, length), ["template", "diagonal"])
    # What is only in the project's folder is not named.
    assert not re.search("docs/|README", config.read_text())
    with pytest.raises(CapsuleError, match="--sensors 0: give a number from 1 to 64"):
        run_command("new", tmp_path / "none", "--sensors", 0)
    monkeypatch.chdir(lab)
    run_command("simulate", "--runs", 1, "--sizes", 3)
    assert f",sensor_{sensors}\n" in (lab / "raw/3mm/r01.csv").read_text()


def test_each_command_checks_the_configuration_of_the_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "config").mkdir()
    (tmp_path / "config/config.yaml").write_text("recording: {sensors: four}\n")
    (tmp_path / "run.csv").touch()
    words = ["judge run.csv", "export --format mat", "simulate", "survey --simulate --out one"]
    for each in (*words, "import run.csv --size 2", "record --size 1 --port none"):
        with pytest.raises(CapsuleError, match=r"config/config\.yaml: "):
            run_command(*each.split())
    assert sorted(path.name for path in tmp_path.iterdir()) == ["config", "run.csv"]


def test_ctrl_c_waits_for_snakemake_to_end_its_jobs(monkeypatch):
    # It ends at the third question.
    called = MagicMock()
    wait = called.return_value.__enter__.return_value.wait
    wait.side_effect = [KeyboardInterrupt, KeyboardInterrupt, 1]
    monkeypatch.setattr(report.subprocess, "Popen", called)
    assert report.call_workflow(PROJECT, []) == report.INTERRUPTED
    assert wait.call_count == 3


def test_what_is_missing_is_named_with_its_remedy(tmp_path, monkeypatch):
    def refused(told):
        with pytest.raises(CapsuleError, match=told):
            report.check_workflow(tmp_path)

    refused("holds no raw; run the command in a folder")
    (tmp_path / "raw").mkdir()
    refused(r"holds no config/config\.yaml; .*capsule new NAME")
    monkeypatch.setattr(report, "PROJECT", tmp_path)
    refused("holds no Snakefile")
    monkeypatch.setattr(report.importlib.util, "find_spec", lambda name: None)
    refused(r'pip install -e "\.\[workflow\]"')


@pytest.mark.slow
@pytest.mark.workflow
@pytest.mark.takes(12)
def test_a_bench_goes_on_after_a_move_and_runs_no_file_of_its_folder(tmp_path):
    run_command("new", bench := tmp_path / "pig-7")
    write_archive(bench / "raw", ["0mm/r01"], samples=525)
    # `python -m` would import it before the library of this name.
    (bench / "yaml.py").write_text("raise SystemExit('this is no code of the project')\n")
    done = call(*CAPSULE, "report", "--cores", "1", "--", "--until", "preprocess", cwd=bench)
    assert done.returncode == 0, done.stderr
    (bench / "yaml.py").unlink()
    plain = [sys.executable, "-m", "snakemake", "-c1", "--dry-run", "results/checks/0mm/r01.json"]
    done = call(*plain, cwd=bench.rename(tmp_path / "pig-8"))
    assert "Nothing to be done" in done.stdout + done.stderr
