"""Get the command-line parser of any script."""

import argparse
import runpy
import sys
from pathlib import Path
from unittest import mock


class _Stopped(BaseException):
    """The signal that a script is about to read its command line; no script catches it."""

    def __init__(self, parser: argparse.ArgumentParser) -> None:
        super().__init__()
        self.parser = parser


def script_parser(script: Path) -> argparse.ArgumentParser:
    """Return the parser with which a script reads its command line.

    The script's `main` runs until it would read the command line, and stops there.

    Parameters
    ----------
    script : Path
        A file with a function `main`.

    Raises
    ------
    ValueError
        The script ends without reading a command line.
    """

    def stop(parser: argparse.ArgumentParser, *_: object) -> None:
        raise _Stopped(parser)

    with (
        mock.patch.object(argparse.ArgumentParser, "parse_known_args", stop),
        mock.patch.object(sys, "argv", [script.name]),
    ):
        try:
            runpy.run_path(str(script))["main"]()
        except _Stopped as stopped:
            return stopped.parser
    raise ValueError(f"{script} reads no command line")
