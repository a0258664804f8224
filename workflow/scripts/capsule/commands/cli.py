"""The command `capsule`: one parser, with a subcommand for each task.

A subcommand's module has two functions: `add_arguments` adds its options to a parser, and `main`
runs it and returns the exit status (None: 0). Its docstring is the first line of the help. Only the
module of the subcommand that is called is imported.
"""

import argparse
import importlib
import os
import signal
import sys
from collections.abc import Sequence
from difflib import get_close_matches
from functools import partial
from typing import NamedTuple, Protocol, cast

from capsule.engine.project import PACKAGE, project_version


class Command(NamedTuple):
    """A subcommand: its module, and one line of help."""

    module: str
    line: str


class CommandModule(Protocol):
    """The functions that the module of a subcommand has."""

    __doc__: str

    def add_arguments(self, parser: argparse.ArgumentParser) -> None:
        """Add the options of the subcommand, and its examples as `parser.epilog`."""

    def main(self, arguments: argparse.Namespace) -> int | None:
        """Run the subcommand, and return the exit status."""


COMMANDS = {
    "record": Command(
        "capsule.bench.record_command", "record a run of the capsule from the logger board"
    ),
    "survey": Command(
        "capsule.bench.survey_command",
        "survey a gut: go back to each suspected nodule, and test it again",
    ),
    "simulate": Command(
        "capsule.phantom.command", "simulate recordings with the model of the paper's phantom"
    ),
    "import": Command(
        "capsule.importing.command", "import recordings from other programs' files into raw/"
    ),
    "export": Command(
        "capsule.exporting.command", "write recordings and results for other programs"
    ),
    "judge": Command("capsule.judging.judged", "judge a recording by every detector"),
    "compare": Command(
        "capsule.commands.compare", "compare two folders of results: settings, code, verdicts"
    ),
    "report": Command(
        "capsule.commands.report", "make results/report.html from the recordings in raw/"
    ),
    "forget": Command(
        "capsule.commands.forget", "remove recordings or surveys, and what names them"
    ),
    "new": Command("capsule.commands.new", "make a folder for a bench: settings and raw/"),
    "parts": Command("capsule.parts.command", "make the parts of capsule and bench to print"),
    "demo": Command(
        "capsule.bench.demo_command", "play a simulated run, judge it live, and make its report"
    ),
}
_HINT = "capsule COMMAND --help shows the options of a command."


def build_parser(words: Sequence[str]) -> argparse.ArgumentParser:
    """Return the parser of the command; subcommands other than `words` have no options.

    Only the modules of `words` are imported.
    """
    parser = argparse.ArgumentParser(prog="capsule", epilog=_HINT)
    version = "print the version, and the folder that the code comes from"
    parser.add_argument("--version", action=_Version, help=version)
    subcommands = parser.add_subparsers(title="commands", metavar="COMMAND", required=True)
    for word, (name, line) in COMMANDS.items():
        own = subcommands.add_parser(
            word, help=line, formatter_class=argparse.RawDescriptionHelpFormatter
        )
        if word in words:
            module = cast(CommandModule, importlib.import_module(name))
            own.description = module.__doc__.strip()
            module.add_arguments(own)
            own.set_defaults(main=module.main)
    return parser


def subparsers(parser: argparse.ArgumentParser) -> dict[str, argparse.ArgumentParser]:
    """Return the parsers of the subcommands by their names."""
    (action,) = (each for each in parser._actions if hasattr(each, "add_parser"))
    return dict(action.choices or {})


class _Version(argparse.Action):
    """Print the version and the folder of the code, and end the program."""

    def __init__(self, option_strings: Sequence[str], dest: str, help: str) -> None:
        super().__init__(option_strings, dest, nargs=0, help=help)

    def __call__(self, parser: argparse.ArgumentParser, *_: object) -> None:
        print(f"capsule {project_version()}, from {PACKAGE}")
        parser.exit()


def unknown(word: str) -> str:
    """Return the error for an unknown subcommand, with the nearest known one."""
    nearest = get_close_matches(word, COMMANDS, n=1, cutoff=0.5)
    hint = f"did you mean {nearest[0]!r}?" if nearest else f"the commands are {', '.join(COMMANDS)}"
    return f"error: capsule has no command {word!r}; {hint}"


def main(words: Sequence[str] | None = None) -> None:
    """Run a subcommand, by default that of the command line, and exit with its status."""
    words = sys.argv[1:] if words is None else words
    if not words:
        build_parser(()).print_help()
        sys.exit(2)
    if words[0] not in COMMANDS and not words[0].startswith("-"):
        print(unknown(words[0]), file=sys.stderr)
        sys.exit(2)
    # During the imports, Ctrl-C would end in a traceback.
    former = signal.signal(signal.SIGINT, lambda *_: os._exit(130))
    try:
        parser = build_parser(words[:1])
        if words[0] not in COMMANDS:
            parser.parse_args(words)  # --help or --version, or an option that does not exist
        arguments = subparsers(parser)[words[0]].parse_args(words[1:])
        from capsule.engine.jobs import run
    finally:
        signal.signal(signal.SIGINT, former)
    run(partial(arguments.main, arguments))
