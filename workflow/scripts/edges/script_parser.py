"""The parser of any script's command line, as the script itself makes it."""

import argparse
import runpy
import sys
from pathlib import Path
from unittest import mock


class _Stopped(BaseException):
    """A script is about to read its command line; no script catches this."""

    def __init__(self, parser: argparse.ArgumentParser) -> None:
        super().__init__()
        self.parser = parser


def script_parser(script: Path) -> argparse.ArgumentParser:
    """Return the parser with which a script reads its command line.

    The script's `main` runs to the moment at which it would read the command line, and no further.

    Parameters
    ----------
    script : Path
        A file with a function `main`.

    Raises
    ------
    ValueError
        It ends without reading a command line.
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
