"""Print a script that completes capsule in your shell: commands, options, sizes and files."""

import argparse
from pathlib import Path

import shtab

from capsule.commands.cli import COMMANDS, build_parser, subparsers

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


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    parser.epilog = DETAILS
    parser.add_argument("shell", choices=shtab.SUPPORTED_SHELLS, help="your shell")


def main(arguments: argparse.Namespace) -> None:
    """Print the completion script."""
    print(shtab.complete(whole_parser(), arguments.shell))


def whole_parser() -> argparse.ArgumentParser:
    """Return the parser of the whole command, each option with the values that complete it."""
    parser = build_parser(tuple(COMMANDS))
    for own in subparsers(parser).values():
        for action in own._actions:
            if action.dest in ("size", "sizes", "nodules"):
                action.choices = SIZES_MM
            elif action.type is Path or action.dest in ("port", "drive", "fold", "recover"):
                folder = action.metavar in FOLDERS
                # The attribute by which shtab knows what completes an option.
                vars(action)["complete"] = shtab.DIRECTORY if folder else shtab.FILE
    return parser
