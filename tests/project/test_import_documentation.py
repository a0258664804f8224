"""docs/import.md shows the real output of the command."""

import contextlib
import io
import itertools
import shlex
import shutil
from pathlib import Path

import pytest

from capsule.commands.cli import build_parser
from capsule.importing.command import Importer
from support.lab_files import write_examples
from support.project import ROOT

pytestmark = pytest.mark.takes(0.1)

TEXT = (ROOT / "docs/import.md").read_text(encoding="utf-8")


class Utf8(io.StringIO):
    """A terminal that shows all characters."""

    encoding = "utf-8"


def shown_blocks():
    """Return each command of the page with the lines that follow it."""
    blocks = []
    for block in TEXT.split("\n\n"):
        lines = [line[4:] for line in block.splitlines() if line.startswith("    ")]
        starts = [number for number, line in enumerate(lines) if line.startswith("$ ")]
        for start, end in itertools.pairwise([*starts, len(lines)]):
            blocks.append((lines[start][2:], lines[start + 1 : end]))
    return blocks


def output(command):
    """Run a command of the page in the working directory, and return its lines."""
    command, _, pipe = command.partition(" | ")
    program, _, count = pipe.partition(" -")
    part = {"": slice(None), "head": slice(int(count or 0)), "tail": slice(-int(count or 0), None)}
    words = shlex.split(command)
    if words[0] in ("head", "cat"):
        lines = Path(words[-1]).read_text(encoding="utf-8").splitlines()
        return lines[: int(words[1][1:])] if words[0] == "head" else lines
    text = Utf8()
    options = build_parser(["import"]).parse_args([*words[1:], "--raw", "raw"])
    with contextlib.redirect_stdout(text), contextlib.redirect_stderr(text):
        importer = Importer(options)
        importer.run()
        print(importer.summary())
    return text.getvalue().splitlines()[part[program]]


def test_the_page_shows_what_the_command_prints(tmp_path, monkeypatch):
    blocks = shown_blocks()
    for ending in ("csv", "mat", "xlsx", "h5", "nwb", "tdms", "xdf", "bag"):
        assert any(f".{ending} " in command for command, _ in blocks)
    examples = tmp_path / "examples"
    examples.mkdir()
    write_examples(examples)
    for number, (command, lines) in enumerate(blocks):
        if command.startswith("capsule") or number == 0:
            folder = tmp_path / str(number)
            shutil.copytree(examples, folder)
            monkeypatch.chdir(folder)
        shown = [line.rstrip() for line in output(command)]
        assert shown == [line.rstrip() for line in lines], command


def test_the_example_of_a_map_is_the_one_that_is_used():
    example = (ROOT / "docs/examples/fabricslide.yaml").read_text(encoding="utf-8")
    assert "".join(f"    {line}\n" for line in example.splitlines()) in TEXT
