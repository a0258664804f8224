"""Print a script that completes capsule in your shell: commands, options, sizes and files."""

import argparse
import sys
from pathlib import Path

import shtab

import capsule_command
from capsule import files
from script_parser import script_parser

DETAILS = """
bash, for your user, where the package bash-completion is installed:
  mkdir -p ~/.local/share/bash-completion/completions
  capsule completion bash > ~/.local/share/bash-completion/completions/capsule
zsh, in a folder of $fpath:
  capsule completion zsh > ~/.zfunc/_capsule
tcsh, in ~/.tcshrc:
  capsule completion tcsh > ~/.capsule.tcsh; source ~/.capsule.tcsh
"""
SIZES_MM = ("0", "1", "2", "3", "4", "5")
FOLDERS = {"FOLDER", "SESSION"}


def completed(parser: argparse.ArgumentParser) -> argparse.ArgumentParser:
    """Mark each option of a parser with the values that complete it, and return the parser."""
    for action in parser._actions:
        if action.dest in ("size", "sizes", "nodules"):
            action.choices = SIZES_MM
        elif action.type is Path or action.dest in ("port", "drive", "fold", "recover"):
            folder = action.metavar in FOLDERS
            action.complete = shtab.DIRECTORY if folder else shtab.FILE
    return parser


def whole_parser() -> argparse.ArgumentParser:
    """Return a parser of the whole command, with the options of each subcommand."""
    parser = argparse.ArgumentParser(prog="capsule")
    words = parser.add_subparsers()
    for word, (script, line) in capsule_command.WORDS.items():
        path = capsule_command.SCRIPTS / script
        # A subcommand whose script is not installed has no options; a call of it says so.
        options = [completed(script_parser(path))] if path.exists() else []
        words.add_parser(word, help=line, parents=options, add_help=False)
    return parser


def main() -> None:
    """Print the completion script."""
    parser = argparse.ArgumentParser(
        description=__doc__, epilog=DETAILS, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("shell", choices=shtab.SUPPORTED_SHELLS, help="your shell")
    shell = parser.parse_args().shell
    print(shtab.complete(whole_parser(), shell))
    sys.exit(0)


if __name__ == "__main__":
    files.run(main)
