"""Python code in the documents runs, and the options of commands exist."""

import argparse
import importlib
import itertools
import os
import re
import shlex
import shutil
import subprocess
import sys

import pytest

from capsule.commands.cli import COMMANDS
from support.command import parsers
from support.documents import Block, all_blocks, blocks, documents
from support.project import ROOT

SCRIPTS = ROOT / "workflow" / "scripts"
# Part of the archive that ships, so that fits take a second.
RECORDINGS = [f"{size}mm/r{run:02d}" for size in (0, 1, 3) for run in (1, 3, 5, 7)]
# Held out, so that in leave-one-out no fold judges it.
RECORDINGS.append("0mm/h01")
BLOCKS = all_blocks()
WITH_PYTHON = list(
    dict.fromkeys(each.document for each in BLOCKS if each.is_python and not each.not_run)
)
# What stands for a name of the reader's own.
PLACEHOLDERS = {"NAME": "uneven-wall"}
# What begins another command.
AFTER = {"|", ";", "&&", ">", "2>&1"}
COMMAND = re.compile(r"(?:^|[ ;&|(])python workflow/studies/(\w+)\.py(.*)")


@pytest.fixture
def copy(tmp_path):
    """Return a folder like the project's, in which examples may write."""
    for name in RECORDINGS:
        path = tmp_path / "raw" / f"{name}.csv"
        path.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(ROOT / "raw" / f"{name}.csv", path)
    (tmp_path / "raw/unlabelled").mkdir()
    shutil.copyfile(ROOT / "raw/3mm/r09.csv", tmp_path / "raw/unlabelled/patient.csv")
    shutil.copytree(ROOT / "config", tmp_path / "config")
    return tmp_path


@pytest.mark.takes
@pytest.mark.parametrize("document", WITH_PYTHON)
def test_the_python_in_a_document_runs_from_top_to_bottom(copy, document):
    run = [each for each in BLOCKS if each.document == document and each.is_python]
    program = "\n".join(each.text for each in run if not each.not_run)
    environment = {"PYTHONPATH": str(SCRIPTS), "MPLBACKEND": "agg", "OPENBLAS_NUM_THREADS": "1"}
    ended = subprocess.run(
        [sys.executable, "-W", "error", "-c", program],
        cwd=copy,
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        check=False,
    )
    assert ended.returncode == 0, ended.stderr


def test_the_readme_shows_python():
    assert {"README.md", "docs/library.md"} <= set(WITH_PYTHON)


def test_blocks_are_told_apart(tmp_path, monkeypatch):
    monkeypatch.setattr("support.documents.ROOT", tmp_path)
    document = tmp_path / "page.md"
    text = "Text:\n\n    import a\n\n    a.b()\n\nMore:\n\n<!-- not run: it takes a board -->\n\n"
    text += "```python\nx = 1\n```\n\n    python workflow/studies/a.py --b \\\n        c\n"
    document.write_text(text)
    assert blocks(document) == [
        Block("page.md", 3, "", "import a\n\na.b()", ""),
        Block("page.md", 11, "python", "x = 1", "it takes a board"),
        Block("page.md", 15, "", "python workflow/studies/a.py --b \\\n    c", ""),
    ]
    assert [each.is_python for each in blocks(document)] == [True, True, False]


def parser_of(study: str) -> argparse.ArgumentParser:
    """Return the parser of a study, by the name of its script."""
    return importlib.import_module(study).build_parser()


def options(parser: argparse.ArgumentParser) -> set[str]:
    """Return all options of a parser and of its sub-commands."""
    known = set(parser._option_string_actions)
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            known = known.union(*map(options, action.choices.values()))
    return known


def commands():
    """Yield each call of a study in a block: its place, the script and its arguments."""
    studies = (block for path in (ROOT / "workflow/studies").glob("*.md") for block in blocks(path))
    for block in [*BLOCKS, *studies]:
        for line in block.text.replace("\\\n", " ").splitlines():
            if called := COMMAND.search(line):
                words = shlex.split(called[2], comments=True)
                own = itertools.takewhile(lambda word: word not in AFTER, words)
                told = [PLACEHOLDERS.get(word, word.removesuffix("...")) for word in own]
                yield pytest.param(called[1], told, id=f"{block}-{called[1]}")


@pytest.mark.parametrize(("script", "arguments"), list(commands()))
def test_a_command_in_a_document_is_one_that_its_study_takes(script, arguments, capsys):
    parser = parser_of(script)
    try:
        parser.parse_args(arguments)
    except SystemExit as ended:
        # It is a call for help, or wrong.
        assert ended.code == 0, capsys.readouterr().err


def mentioned():
    """Yield each option that a document names with its command, in a sentence or a block."""
    for document in documents():
        text = document.read_text(encoding="utf-8")
        for word, option in re.findall(r"\bcapsule ([a-z]+) (--[a-z][a-z-]*)", text):
            if word in COMMANDS:
                yield f"{document.relative_to(ROOT).as_posix()}: capsule {word} {option}"


@pytest.mark.parametrize("mention", sorted(set(mentioned())))
def test_an_option_that_a_document_names_exists(mention):
    word, option = mention.rpartition(": capsule ")[2].split()
    assert option in options(parsers()[word])


def test_a_wrong_option_would_be_seen(capsys):
    with pytest.raises(SystemExit):
        parsers()["simulate"].parse_args(["--no-such-option"])
    assert "--no-such-option" in capsys.readouterr().err
    assert "--no-such-option" not in options(parser_of("study_phantom"))
    assert {"--bench", "--candidates", "--archives"} <= options(parser_of("study_phantom"))
