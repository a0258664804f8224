"""Run the command: `python -m capsule`, or `python workflow/scripts/capsule` if not installed."""

import sys
from pathlib import Path

if not __package__:
    # Python has put this folder on the path, where each module would stand for one of its own.
    sys.path[0] = str(Path(__file__).resolve().parents[1])

from capsule.commands.cli import main

main()
