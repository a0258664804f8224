"""Python looks for garbage seldom."""

import subprocess
import sys
from pathlib import Path

SCRIPTS = Path(__file__).parents[2] / "workflow" / "scripts"
# Counts the collections while many objects come and go, and at the end of the process.
PROGRAM = f"""
import atexit, gc, sys
sys.path.insert(0, {str(SCRIPTS)!r})
from edges.garbage import collect_seldom
if sys.argv[1] == "seldom":
    collect_seldom()
seen = []
gc.callbacks.append(lambda phase, info: seen.append(phase))
kept = [[] for _ in range(90_000)]
print(len(seen) > 0, gc.get_freeze_count() > 0)
"""


def looked(how):
    """Return whether Python has looked for garbage, and whether it exempts the imports."""
    ended = subprocess.run(
        [sys.executable, "-c", PROGRAM, how], capture_output=True, text=True, check=True
    )
    return ended.stdout.split()


def test_it_looks_seldom_and_not_among_the_imports():
    assert looked("as ever") == ["True", "False"]
    assert looked("seldom") == ["False", "True"]
