"""The commands in the documents exist, docs/command.md has all, and those of the tutorial run."""

import re
import shlex
import shutil
import subprocess

import pytest

from capsule.commands.cli import COMMANDS, build_parser
from support.command import CAPSULE, parsers
from support.documents import all_blocks
from support.project import ROOT

CALL = re.compile(r"(?:\$ )?(capsule (\w+)\b.*)")
# What begins another command.
AFTER = re.compile(r" [>|] | && ")


def calls():
    """Yield each call of the command `capsule` in a block: its place, its line and its word."""
    for block in all_blocks():
        for line in block.text.replace("\\\n", " ").splitlines():
            call = CALL.fullmatch(line)
            # Not what stands for any word, the answer to a wrong one, or a key on its way.
            if call and call[2] not in ("COMMAND", "jugde") and "<Tab>" not in line:
                yield str(block), AFTER.split(call[1])[0], call[2]


PAGE = "docs/command.md"
SECTIONS = dict(
    re.findall(
        r"^## capsule (\w+)\n(.*?)(?=^## |\Z)",
        (ROOT / PAGE).read_text(encoding="utf-8"),
        re.MULTILINE | re.DOTALL,
    )
)
# Each line of a block of README and tutorial begins with one of these; the named file runs such a
# line, or nobody does, for the reason given.
SHOWN_BY = {
    "make report": ".ci/run",
    "make test": ".ci/run",
    "pip install --require-hashes -r requirements-test.lock": ".github/workflows/check.yml",
    "pip install --no-deps --no-build-isolation -e .": ".github/workflows/check.yml",
    "snakemake -c2 results/report.html": "tests/workflow/test_workflow.py",
    "pytest": ".github/workflows/check.yml",
    "capsule demo": "tests/capsule/bench/test_demo.py",
    "capsule judge": "tests/capsule/judging/test_judged.py",
    "capsule simulate": "tests/project/test_commands_of_documents.py",
    "capsule report": "tests/project/test_make.py",
    "capsule --help": "tests/project/test_command.py",
}
NOT_RUN = {
    "capsule record": "it needs the logger board, and the document says so",
    "conda": "it needs conda",
    "py -m venv": "it needs Windows",
    "source .venv/bin/activate": "a shell's own",
    "cd ": "a shell's own",
    "mkdir ": "a shell's own",
    "cp ": "a shell's own",
}


def lines_to_type(document):
    """Yield the lines of a document that a reader types."""
    for block in all_blocks():
        if block.document == document and not block.is_python:
            lines = [line for line in block.text.splitlines() if line]
            yield from [line[2:] for line in lines if line.startswith("$ ")] or lines


@pytest.mark.parametrize("document", ["README.md", "docs/tutorial.md"])
def test_every_line_that_a_newcomer_types_is_run_or_has_a_reason(document):
    lines = list(lines_to_type(document))
    assert len(lines) > 8
    for line in lines:
        assert line.startswith((*SHOWN_BY, *NOT_RUN)), line
        if line.startswith("capsule record"):
            assert "needs the logger board" in line
    assert all((ROOT / path).exists() for path in SHOWN_BY.values())


def words_of(line):
    return shlex.split(line, comments=True)[2:]


@pytest.mark.parametrize(
    ("line", "word"), sorted({(line, word) for _, line, word in calls()}), ids=lambda each: each
)
def test_a_call_of_the_command_in_a_document_is_one_that_it_takes(line, word, capsys):
    try:
        parsers()[word].parse_args(words_of(line))
    except SystemExit as ended:
        assert ended.code == 0, capsys.readouterr().err


def test_the_page_of_the_command_has_an_example_of_each():
    text = (ROOT / PAGE).read_text(encoding="utf-8")
    assert set(re.findall(r"(?:`|\$ )capsule (\w+)", text)) >= set(COMMANDS)


def test_the_help_stands_there_as_the_command_prints_it(monkeypatch):
    monkeypatch.setenv("COLUMNS", "100")
    lines = build_parser(()).format_help().splitlines()
    shown = "\n".join(f"    {line}".rstrip() for line in lines)
    assert f"    $ capsule --help\n{shown}\n" in (ROOT / PAGE).read_text(encoding="utf-8")


@pytest.mark.parametrize("word", SECTIONS)
def test_every_option_that_its_section_names_exists(word):
    named = set(re.findall(r"(?<![\w-])--[a-z][a-z-]*", SECTIONS[word]))
    assert named <= {*parsers()[word]._option_string_actions}


def test_every_option_of_the_commands_that_are_described_there_alone_is_named():
    for word in SECTIONS:
        options = {*parsers()[word]._option_string_actions} - {"-h", "--help"}
        assert options <= set(re.findall(r"--[a-z-]+", SECTIONS[word])), word


def test_make_has_what_the_documents_make():
    targets = set(re.findall(r"^(\w+):", (ROOT / "Makefile").read_text(encoding="utf-8"), re.M))
    made = {
        name
        for block in all_blocks()
        for name in re.findall(r"^make (\w+)", block.text, re.MULTILINE)
    }
    assert {"report", "test"} <= made <= targets


@pytest.mark.takes
def test_the_simulations_of_the_tutorial_run_in_their_order(tmp_path):
    shutil.copytree(ROOT / "config", tmp_path / "config")
    lines = [
        line
        for document, line, word in calls()
        if document.startswith("docs/tutorial.md") and word == "simulate"
    ]
    assert len(lines) == 3
    printed = ""
    for line in lines:
        done = subprocess.run(
            [*CAPSULE, "simulate", *words_of(line)],
            cwd=tmp_path,
            capture_output=True,
            text=True,
            check=True,
        )
        printed += done.stdout + done.stderr
    assert len(list((tmp_path / "uneven/raw").rglob("*.csv"))) == 48
    assert "simulated 1 of 1 recordings in mine/" in printed
    # The recording whose verdicts the tutorial shows.
    head = (tmp_path / "mine/3mm/r01.csv").read_text(encoding="utf-8").splitlines()
    samples = sum(not line.startswith("#") for line in head) - 1
    text = (ROOT / "docs/tutorial.md").read_text(encoding="utf-8")
    assert f"mine/3mm/r01.csv: {samples} samples, " in text
