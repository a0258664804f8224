"""The blocks of code in the documents run, and the commands in them exist."""

import importlib
import io
import itertools
import os
import re
import shlex
import shutil
import subprocess
import sys
from contextlib import chdir, redirect_stderr, redirect_stdout
from pathlib import Path

import nbformat
import numpy as np
import pytest
from nbclient import NotebookClient

from capsule.commands.cli import COMMANDS, main
from support.command import output_of, parsers
from support.documents import all_blocks, blocks, documents, text_of
from support.importing import assert_readings, import_files
from support.lab_files import KILO_OHMS, TIME_S, write_examples
from support.project import ROOT

BLOCKS = all_blocks()
# Part of the archive that ships, so that fits take a second.
RECORDINGS = [f"{size}mm/r{run:02d}" for size in (0, 3) for run in (1, 3, 5, 7)]
# Held out, so that in leave-one-out no fold judges it.
RECORDINGS.append("0mm/h01")
WITH_PYTHON = {each.document for each in BLOCKS if each.is_python and not each.not_run}
PAGE, TUTORIAL = "docs/command.md", ROOT / "docs" / "tutorial.ipynb"
PAGE_TEXT = text_of(PAGE)
SECTIONS = dict(re.findall(r"(?ms)^## capsule (\w+)\n(.*?)(?=^## |\Z)", PAGE_TEXT))
# What does not run here: it belongs to a shell, never ends, or removes what later lines read.
NOT_RUN = ("source ", "capsule demo", "capsule forget")
PROGRAMS = {"make", "pip", "snakemake", "sbatch", "capsule", "conda", "py", "source", "python"}
PROGRAMS |= {"mkdir", "cd", "cp", "sed", "grep", "head", "cat", "diff"}
# Of the report, what the lines after it read, in few jobs.
REPORT = "snakemake -c2 --config recordings_per_job=20 -- results/{recordings,detections}.csv"
ENVIRONMENT = os.environ | {"PATH": f"{Path(sys.executable).parent}:{os.environ['PATH']}"}
# What begins another command, and what stands for a name of the reader's own.
AFTER = {"|", ";", "&&", ">", "2>&1"}
PLACEHOLDERS = {"NAME": "uneven-wall"}
# A call of the command or of a study. Not what stands for any word, or the answer to a wrong one.
CALL = re.compile(
    r"^(?:\$ )?(?:capsule (?!COMMAND|jugde)|.*?\bpython workflow/studies/)(\w+)(?:\.py)?\b(.*)"
)


@pytest.mark.takes
@pytest.mark.parametrize("document", sorted(WITH_PYTHON | {"README.md", "docs/library.md"}))
def test_the_python_in_a_document_runs_from_top_to_bottom(tmp_path, monkeypatch, document):
    """In a folder like the project's, in which examples may write."""
    copies = {name: name for name in RECORDINGS} | {"3mm/r09": "unlabelled/patient"}
    for name, copy in copies.items():
        path = tmp_path / "raw" / f"{copy}.csv"
        path.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(ROOT / "raw" / f"{name}.csv", path)
    shutil.copytree(ROOT / "config", tmp_path / "config")
    monkeypatch.chdir(tmp_path)
    run = [each for each in BLOCKS if each.document == document and each.is_python]
    program = "\n".join(each.text for each in run if not each.not_run)
    assert program
    exec(compile(program, document, "exec"), {})


def calls():
    """Return each call in a block, with its words up to the next command; each only once."""
    studies = (block for path in (ROOT / "workflow/studies").glob("*.md") for block in blocks(path))
    found = {}
    for block in [*BLOCKS, *studies]:
        for line in block.text.replace("\\\n", " ").splitlines():
            if (call := CALL.match(line)) and "<Tab>" not in line:
                words = shlex.split(call[2], comments=True)
                own = itertools.takewhile(lambda word: word not in AFTER, words)
                told = [PLACEHOLDERS.get(word, word.removesuffix("...")) for word in own]
                found[" ".join([call[1], *told])] = call[1], told
    return found


@pytest.mark.parametrize(("program", "words"), calls().values(), ids=calls())
def test_a_call_in_a_document_is_one_that_its_command_or_study_takes(program, words, capsys):
    parser = parsers().get(program) or importlib.import_module(program).build_parser()
    try:
        parser.parse_args(words)
    except SystemExit as ended:
        # It is a call for help, or wrong.
        assert ended.code == 0, capsys.readouterr().err


def options(word):
    """Return the options of a command but those for help."""
    return parsers()[word]._option_string_actions.keys() - {"-h", "--help"}


def test_the_documents_name_each_command_options_that_there_are_and_the_targets_of_make():
    assert set(re.findall(r"(?:`|\$ )capsule (\w+)", PAGE_TEXT)) >= set(COMMANDS)
    # The section of a command names its options, and no others.
    for word, section in SECTIONS.items():
        named = set(re.findall(r"(?<![\w-])--[a-z][a-z-]*", section))
        assert {each for each in options(word) if each.startswith("--")} == named, word
    every = "\n".join(document.read_text(encoding="utf-8") for document in documents())
    for word, option in re.findall(r"\bcapsule ([a-z]+) (--[a-z][a-z-]*)", every):
        assert word not in COMMANDS or option in options(word) | {"--help"}, (word, option)
    targets = set(re.findall(r"^(\w+):", text_of("Makefile"), re.M))
    shown = "\n".join(block.text for block in BLOCKS)
    assert {"report", "test", "docs"} <= set(re.findall(r"^make (\w+)", shown, re.M)) <= targets


def lines_to_type(document):
    """Yield each line that a reader types, with the lines that the document shows below it."""
    for block in BLOCKS:
        if block.document == document and not block.is_python and not block.language:
            text = block.text.replace("\\\n", " ") + "\n"
            # Only below a line with a prompt stands what it prints, up to an empty line.
            call = re.compile(r"^(\$ )?(.+)\n((?(1)(?:(?!\$ ).+\n)*))", re.MULTILINE)
            for _, typed, shown in call.findall(text):
                if typed.lstrip("(").partition(" ")[0] in PROGRAMS:
                    yield typed, shown.removesuffix("\n")


def run_lines(folder, lines):
    """Run lines in one shell; fail at the first that fails, or prints other than is shown."""
    for line, shown in lines:
        if line.startswith(NOT_RUN):
            continue
        if line.startswith("capsule import "):
            status, output = import_here(folder, line)
        else:
            command = REPORT if line == "capsule report" else line
            script = f"cd {shlex.quote(str(folder))}\n{command}\npwd > {folder.parent}/here"
            call = {"args": ["bash", "-e", "-c", f"exec 2>&1\n{script}"], "env": ENVIRONMENT}
            done = subprocess.run(**call, check=False, stdout=subprocess.PIPE, text=True)
            status, output = done.returncode, done.stdout
        assert status == bool(re.search("^refused: ", shown, re.M)), f"{line}\n{output}"
        printed = "\n".join(each.rstrip() for each in output.splitlines())
        # A line of dots stands for any others, and so does nothing at all.
        expected = ".*".join(map(re.escape, (shown or "...").split("...")))
        assert re.fullmatch(expected, printed, re.DOTALL), f"{line}\n{printed}"
        folder = Path((folder.parent / "here").read_text().strip()) if "cd " in line else folder
    return folder


def import_here(folder, line):
    """Import in this process, which imports each package once; return status and output."""
    (call, _, rest), status = line.partition(" | "), 0
    printed = io.TextIOWrapper(io.BytesIO(), encoding="utf-8")
    with chdir(folder), redirect_stdout(printed), redirect_stderr(printed):
        try:
            main(shlex.split(call)[1:])
        except SystemExit as ended:
            status = ended.code
    printed.seek(0)
    return status, output_of("sh", "-c", rest or "cat", input=printed.read())


@pytest.mark.slow
@pytest.mark.takes(60)
def test_what_the_documents_show_runs_in_the_folder_of_the_tutorial(tmp_path):
    (folder := tmp_path / "start").mkdir()
    for document in ("docs/tutorial.md", PAGE):
        folder = run_lines(folder, lines_to_type(document))
    assert (folder / "monday.png").stat().st_size > 50_000


@pytest.mark.slow
@pytest.mark.takes
def test_the_page_on_the_import_shows_what_the_command_prints(tmp_path):
    lines = list(lines_to_type("docs/import.md"))
    for ending in ("csv", "mat", "xlsx", "h5", "nwb", "tdms", "xdf", "bag"):
        assert any(f".{ending} " in command for command, _ in lines)
    examples = tmp_path / "examples"
    shutil.copytree(ROOT / "config", examples / "config")
    write_examples(examples)
    for number, line in enumerate(lines):
        run_lines(shutil.copytree(examples, tmp_path / str(number)), [line])


def test_the_map_in_the_manual_is_the_one_that_is_used_and_the_readmes_file_is_imported(tmp_path):
    example = text_of("docs/examples/fabricslide.yaml")
    assert example.rstrip() in [each.text for each in BLOCKS if each.document == "docs/import.md"]
    (block,) = [each.text for each in BLOCKS if "time_ms,S1_kOhm" in each.text]
    rows, names = np.vstack([1000 * TIME_S, KILO_OHMS]).T, block.splitlines()[0]
    np.savetxt(tmp_path / "r01.csv", rows, "%.12g", ",", header=names, comments="")
    recording = import_files(tmp_path, tmp_path / "r01.csv").the_recording()
    assert recording.header["unit"] == "kohm"
    assert_readings(recording, TIME_S, KILO_OHMS)


@pytest.mark.slow
@pytest.mark.takes
@pytest.mark.filterwarnings("ignore:Kernel is running over TCP")
def test_the_tutorial_gives_what_it_shows(monkeypatch):
    monkeypatch.setenv("PYTHONPATH", os.fspath(ROOT / "workflow" / "scripts"))
    stored, fresh = (nbformat.read(TUTORIAL, as_version=4) for _ in range(2))
    NotebookClient(fresh, timeout=300, resources={"metadata": {"path": TUTORIAL.parent}}).execute()
    made, shown = (
        [each.get("data", each) for cell in book.cells for each in cell.get("outputs", [])]
        for book in (fresh, stored)
    )
    # Of a picture, only that there is one.
    texts = [[each.get("text", each.get("text/plain")) for each in of] for of in (made, shown)]
    assert texts[0] == texts[1]
    assert sum("image/png" in each for each in made) >= 5
