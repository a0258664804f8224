"""Call programs in processes of their own, and the command `capsule` inside that of the tests."""

import subprocess
import sys

from capsule.commands.cli import COMMANDS, build_parser, subparsers
from support.project import ROOT

# The first words of a call, in the environment of the tests but with the code of this folder.
CAPSULE = [sys.executable, str(ROOT / "workflow" / "scripts" / "capsule")]


def output_of(*words, **settings):
    """Run a program, and return what it prints; a test fails with all of it if the program does."""
    done = subprocess.run([*map(str, words)], capture_output=True, text=True, **settings)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def parsers():
    """Return the parsers of all subcommands by their names; this imports all their modules."""
    return subparsers(build_parser(tuple(COMMANDS)))


def run_command(*words: object) -> int:
    """Run a subcommand in this process, and return its status; its errors are not caught."""
    arguments = build_parser([str(words[0])]).parse_args([str(word) for word in words])
    return arguments.main(arguments) or 0
