"""Call the command `capsule` in a process of its own, or inside that of the tests."""

import functools
import sys

from capsule.commands.cli import COMMANDS, build_parser, subparsers
from support.project import ROOT

# The first words of a call, in the environment of the tests but with the code of this folder.
CAPSULE = [sys.executable, str(ROOT / "workflow" / "scripts" / "capsule")]


@functools.cache
def parsers():
    """Return the parsers of all subcommands by their names; this imports all their modules."""
    return subparsers(build_parser(tuple(COMMANDS)))


def run_command(*words: object) -> int:
    """Run a subcommand in this process, and return its status; its errors are not caught."""
    arguments = build_parser([str(words[0])]).parse_args([str(word) for word in words])
    return arguments.main(arguments) or 0
