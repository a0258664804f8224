"""The words of the command capsule start the right programs."""

import re
import shutil
import subprocess
import sys

import pytest

import capsule_command
from script_parser import script_parser
from support.project import ROOT

pytestmark = pytest.mark.takes(0.3)

COMMAND = ROOT / "workflow/scripts/capsule_command.py"
PRESENT = [
    word
    for word, (script, _) in capsule_command.WORDS.items()
    if (capsule_command.SCRIPTS / script).exists()
]


def call(*words, command=COMMAND, **settings):
    return subprocess.run(
        [sys.executable, command, *words],
        capture_output=True,
        text=True,
        encoding="utf-8",
        check=False,
        **settings,
    )


def test_help_lists_the_words_and_imports_nothing_heavy():
    done = subprocess.run(
        [sys.executable, "-X", "importtime", COMMAND, "--help"],
        capture_output=True,
        text=True,
        check=True,
    )
    listed = re.findall(r"^  (\w+)  +\w", done.stdout, re.MULTILINE)
    assert listed == list(capsule_command.WORDS)
    imported = {line.rpartition("|")[2].strip() for line in done.stderr.splitlines()}
    assert "pathlib" in imported
    assert not {"numpy", "argparse", "capsule", "serial", "difflib"} & imported


def test_without_a_word_the_help_is_an_error():
    done = call()
    assert (done.returncode, done.stdout) == (2, capsule_command.help_text() + "\n")


@pytest.mark.parametrize(
    ("word", "hint"),
    [("jugde", "did you mean 'judge'?"), ("reports", "did you mean 'report'?"), ("xyz", "record,")],
)
def test_a_wrong_word_is_answered_with_the_nearest(word, hint):
    done = call(word)
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.startswith(f"error: capsule has no command {word!r}; ")
    assert hint in done.stderr


@pytest.mark.parametrize("word", PRESENT)
def test_a_word_is_called_by_its_name_from_any_folder(word, tmp_path):
    done = call(word, "--no-such-option", cwd=tmp_path)
    assert done.returncode == 2
    assert done.stderr.startswith(f"usage: capsule {word} ")


def test_errors_and_status_are_those_of_the_script(tmp_path):
    words = ("--size", "3", "--port", tmp_path / "none", "--raw", tmp_path, "--logs", tmp_path)
    by_word = call("record", *words)
    by_script = call(*words, command=ROOT / "workflow/scripts/acquire.py")
    assert by_word.returncode == by_script.returncode == 3
    assert by_word.stderr == by_script.stderr


def test_the_scripts_keep_their_own_names():
    done = call("--size", command=ROOT / "workflow/scripts/acquire.py")
    assert done.stderr.startswith("usage: acquire.py ")


def test_installed_it_finds_the_scripts_beside_it(tmp_path):
    scripts = tmp_path / "capsule_project/workflow/scripts"
    scripts.mkdir(parents=True)
    command = shutil.copy(COMMAND, tmp_path)
    done = call("judge", "x", command=command)
    assert done.returncode == 1
    assert done.stderr.rstrip() == (
        f"error: {scripts}/judge_file.py is missing; install the project again"
    )
    (scripts / "beside.py").write_text("text = 'beside'")
    (scripts / "judge_file.py").write_text(
        "import sys, beside\nprint(__name__, sys.argv, beside.text)\nsys.exit(7)"
    )
    done = call("judge", "x", "--y", command=command)
    assert done.returncode == 7
    assert done.stdout == "__main__ ['capsule judge', 'x', '--y'] beside\n"


def test_the_parser_of_a_script_is_its_own(tmp_path):
    parser = script_parser(ROOT / "workflow/scripts/simulate.py")
    assert parser.prog == "simulate.py"
    assert parser.parse_args(["--seed", "7"]).seed == 7
    (tmp_path / "silent.py").write_text("def main():\n    pass\n")
    with pytest.raises(ValueError, match="reads no command line"):
        script_parser(tmp_path / "silent.py")


def test_ctrl_c_while_a_script_is_read_is_no_traceback(tmp_path):
    scripts = tmp_path / "capsule_project/workflow/scripts"
    scripts.mkdir(parents=True)
    (scripts / "demo.py").write_text("raise KeyboardInterrupt\n")
    done = call("demo", command=shutil.copy(COMMAND, tmp_path))
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "")
