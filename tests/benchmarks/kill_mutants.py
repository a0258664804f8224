"""Change the code in random places, and count how often the tests notice.

    python tests/benchmarks/kill_mutants.py --seed 1 --count 40

Each mutant changes one comparison, one operator or one number of a module, in a copy of the
project. The tests of the module's folder must kill it, those that `make test` runs: tests/capsule/
detectors for a module of `capsule.detectors`, and the files of tests/capsule itself for a module
that lies in no folder. A mutant that runs four times as long as the tests did without it is dead,
too. Only modules of functions on arrays and tables are changed, and none that reads files or
calls programs.

A mutant that lives shows a law that no test states. Add the law to the tests, not the line: a
formula written out slowly, a value exactly at the limit, a property of all inputs. Some mutants
change nothing that can be seen, such as a limit to which no value is equal. A person must judge
these. To judge the tests, take a seed to which none of them was fitted.
"""

import argparse
import ast
import difflib
import os
import random
import re
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import NamedTuple

from tables import ROOT

LIBRARY = Path("workflow/scripts/capsule")
TESTS = Path("tests/capsule")
ROOMS = [".", "method", "recordings", "detectors", "evaluation"]
# Modules that import one of these know files or programs.
SYSTEM = {"pathlib", "os", "shutil", "glob", "tempfile", "subprocess", "multiprocessing", "fcntl"}
LEFT_OUT = shutil.ignore_patterns(".git", ".venv", "__pycache__", ".snakemake", "build", "results")
ENVIRONMENT = {**os.environ, "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
# What a comparison or an operator may become.
CHANGES: dict[type[ast.AST], tuple[type[ast.AST], ...]] = {
    ast.Lt: (ast.LtE, ast.Gt),
    ast.LtE: (ast.Lt, ast.GtE),
    ast.Gt: (ast.GtE, ast.Lt),
    ast.GtE: (ast.Gt, ast.LtE),
    ast.Eq: (ast.NotEq,),
    ast.NotEq: (ast.Eq,),
    ast.Is: (ast.IsNot,),
    ast.IsNot: (ast.Is,),
    ast.In: (ast.NotIn,),
    ast.NotIn: (ast.In,),
    ast.Add: (ast.Sub,),
    ast.Sub: (ast.Add,),
    ast.Mult: (ast.Div,),
    ast.Div: (ast.Mult,),
    ast.FloorDiv: (ast.Mult,),
    ast.Mod: (ast.Mult,),
    ast.Pow: (ast.Mult,),
    ast.BitAnd: (ast.BitOr,),
    ast.BitOr: (ast.BitAnd,),
    ast.And: (ast.Or,),
    ast.Or: (ast.And,),
    ast.USub: (ast.UAdd,),
}


class Place(NamedTuple):
    """A place in a module: the node, counted as `ast.walk` meets it, and the comparison in it."""

    module: Path
    node: int
    operator: int = 0


class Mutant(NamedTuple):
    """A changed module, with the line that differs."""

    module: Path
    text: str
    before: str
    after: str


def modules(rooms: list[str]) -> list[Path]:
    """Return the modules that may be changed; the room "." is that of modules in no folder."""
    found = [path for room in rooms for path in sorted((ROOT / LIBRARY / room).glob("*.py"))]
    known = re.compile(rf"^\s*(?:import|from) (?:{'|'.join(SYSTEM)})\b", re.MULTILINE)
    return [path.relative_to(ROOT) for path in found if not known.search(path.read_text("utf-8"))]


def skipped(tree: ast.AST) -> set[int]:
    """Return the identities of all nodes in annotations and in decorators."""
    left: list[ast.AST | None] = []
    for node in ast.walk(tree):
        left += [getattr(node, "returns", None), getattr(node, "annotation", None)]
        left += getattr(node, "decorator_list", [])
    return {id(inner) for node in left if node for inner in ast.walk(node)}


def places(module: Path) -> Iterator[Place]:
    """Yield all places of a module that a mutant may change."""
    tree = ast.parse((ROOT / module).read_text(encoding="utf-8"))
    left = skipped(tree)
    for number, node in enumerate(ast.walk(tree)):
        if id(node) in left:
            continue
        if isinstance(node, ast.Compare):
            yield from (Place(module, number, turn) for turn in range(len(node.ops)))
        elif isinstance(node, ast.BinOp | ast.BoolOp | ast.UnaryOp | ast.AugAssign):
            if type(node.op) in CHANGES:
                yield Place(module, number)
        elif isinstance(node, ast.Constant) and type(node.value) in (int, float):
            yield Place(module, number)


def mutant(place: Place, draw: random.Random) -> Mutant:
    """Change a module in one place."""
    tree = ast.parse((ROOT / place.module).read_text(encoding="utf-8"))
    before = ast.unparse(tree)
    node = list(ast.walk(tree))[place.node]
    if isinstance(node, ast.Compare):
        old = type(node.ops[place.operator])
        node.ops[place.operator] = draw.choice(CHANGES[old])()
    elif not isinstance(node, ast.Constant):
        node.op = draw.choice(CHANGES[type(node.op)])()
    elif isinstance(node.value, int):
        node.value += draw.choice((-1, 1)) if node.value else 1
    else:
        node.value = node.value * draw.choice((0.5, 1.5)) if node.value else 1.0
    after = ast.unparse(tree)
    differing = list(difflib.ndiff(before.splitlines(), after.splitlines()))
    removed, added = (
        " ".join(line[2:].strip() for line in differing if line.startswith(sign)) for sign in "-+"
    )
    return Mutant(place.module, after + "\n", removed, added)


def run_tests(
    module: Path, text: str | None = None, seconds: float | None = None
) -> tuple[str, float]:
    """Run the tests of a module's folder in a copy of the project, as `make test` selects them.

    The test files that have the module's name come first. `text` is the module's text in the copy.
    Returns the first test that failed ("time" if they took too long, empty if all passed), and how
    many seconds they took.
    """
    with tempfile.TemporaryDirectory() as folder:
        project = shutil.copytree(ROOT, Path(folder) / "project", ignore=LEFT_OUT)
        if text is not None:
            (project / module).write_text(text, encoding="utf-8")
        tests = project / TESTS / module.relative_to(LIBRARY).parent
        files = sorted(tests.glob("test_*.py"))
        files.sort(key=lambda path: module.stem not in path.stem)
        command = [sys.executable, "-B", "-m", "pytest", "-q", "-x", "-p", "no:cacheprovider"]
        command += ["-m", "not slow", "--hypothesis-seed=0", *map(str, files)]
        start = time.perf_counter()
        try:
            settings = {"cwd": project, "env": ENVIRONMENT, "timeout": seconds}
            ended = subprocess.run(command, capture_output=True, text=True, check=False, **settings)
        except subprocess.TimeoutExpired:
            return "time", time.perf_counter() - start
    took = time.perf_counter() - start
    if ended.returncode == 0:
        return "", took
    failed = re.search(r"^(?:FAILED|ERROR) (\S+)", ended.stdout, re.MULTILINE)
    return failed[1].rpartition("/")[2] if failed else "error", took


def judge(mutants: list[Mutant], jobs: int) -> Iterator[tuple[Mutant, str]]:
    """Yield each mutant with the test that killed it, in their order; empty if it lives."""
    limits = {}
    for each in mutants:
        if each.module.parent not in limits:
            failed, took = run_tests(each.module)
            if failed:
                raise SystemExit(f"{failed} fails without a mutant; correct it first")
            limits[each.module.parent] = 4 * took + 20
    with ThreadPoolExecutor(jobs) as threads:
        judged = threads.map(
            lambda each: run_tests(each.module, each.text, limits[each.module.parent])[0], mutants
        )
        yield from zip(mutants, judged, strict=True)


def main() -> None:
    """Print a table of mutants: dead or alive, with the line before and after."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seed", type=int, default=1, help="draws the mutants (default: 1)")
    parser.add_argument("--count", type=int, default=40, help="mutants (default: 40)")
    parser.add_argument("--jobs", type=int, default=2, help="mutants at a time (default: 2)")
    rooms = "folders of the library, . for the modules in none (default: those of the maths)"
    parser.add_argument("--rooms", nargs="+", default=ROOMS, help=rooms)
    options = parser.parse_args()
    draw = random.Random(options.seed)
    every = [place for module in modules(options.rooms) for place in places(module)]
    chosen = draw.sample(every, min(options.count, len(every)))
    killed = 0
    for each, by in judge([mutant(place, draw) for place in chosen], options.jobs):
        killed += bool(by)
        name = each.module.relative_to(LIBRARY)
        print(f"{'killed' if by else 'ALIVE '}  {name}  {by}")
        print(f"    - {each.before}\n    + {each.after}", flush=True)
    print(f"{killed} of {len(chosen)} killed; {len(every)} places in all")


if __name__ == "__main__":
    main()
