"""docs/command.md describes every word of the command, and only options that exist."""

import re
import shlex

import pytest

import capsule_command
from script_parser import script_parser
from support.project import ROOT

PAGE = (ROOT / "docs/command.md").read_text(encoding="utf-8")
SECTIONS = dict(re.findall(r"^## capsule (\w+)\n(.*?)(?=^## |\Z)", PAGE, re.MULTILINE | re.DOTALL))
# The words whose scripts are there.
PARSERS = {
    word: script_parser(capsule_command.SCRIPTS / script)
    for word, (script, _) in capsule_command.WORDS.items()
    if (capsule_command.SCRIPTS / script).exists()
}
CALLS = [
    (word, line.partition(" > ")[0])
    for word, section in SECTIONS.items()
    for line in re.findall(rf"^ +\$ (capsule {word}\b.*)$", section, re.MULTILINE)
    if "<Tab>" not in line
]


def test_every_word_has_a_section_and_an_example():
    assert set(SECTIONS) == set(capsule_command.WORDS)
    assert {word for word, _ in CALLS} == set(capsule_command.WORDS)
    for word, (script, _) in capsule_command.WORDS.items():
        assert f"| `{word}` | `{script}`" in PAGE


def test_the_help_stands_there_as_the_command_prints_it():
    shown = "\n".join(f"    {line}".rstrip() for line in capsule_command.help_text().splitlines())
    assert f"    $ capsule --help\n{shown}\n" in PAGE


@pytest.mark.parametrize("word", PARSERS)
def test_every_option_that_is_named_exists(word):
    named = set(re.findall(r"(?<![\w-])--[a-z][a-z-]*", SECTIONS[word]))
    # What completion lists in its example are the options of the word judge.
    known = {*PARSERS[word]._option_string_actions}
    known |= {*PARSERS["judge"]._option_string_actions} if word == "completion" else set()
    assert named <= known


@pytest.mark.parametrize(("word", "line"), [call for call in CALLS if call[0] in PARSERS])
def test_every_call_is_one_that_the_word_takes(word, line):
    _, called, *options = shlex.split(line)
    assert called == word
    PARSERS[word].parse_args(options)


def test_every_option_of_the_words_that_are_told_here_alone_is_named():
    for word in ("judge", "demo", "report"):
        options = {*PARSERS[word]._option_string_actions} - {"-h", "--help"}
        assert options <= set(re.findall(r"--[a-z-]+", SECTIONS[word])), word
