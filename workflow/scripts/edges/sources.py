"""Which files a script's result depends on: itself and the library modules that it imports.

Imports nothing heavy: the Snakefile asks at every start.
"""

import ast
from collections.abc import Iterable, Iterator
from functools import cache
from pathlib import Path


def imported_files(script: Path, modules: Iterable[str] = ()) -> list[Path]:
    """Find the local modules that a script imports, directly or through one another.

    Parameters
    ----------
    script : Path
        A script; modules are looked for beside it, in the folder of the library's package.
    modules : iterable of str
        More modules that it imports, by names that a registry gives.

    Returns
    -------
    list of Path
        Sorted, without the script itself; what is not found beside it belongs to Python or an
        installed package.
    """
    folder = script.parent
    waiting = {script, *_files_of(frozenset(modules), folder)}
    reached = set()
    while waiting:
        source = waiting.pop()
        reached.add(source)
        waiting |= _files_of(_imports(source), folder) - reached
    return sorted(reached - {script})


@cache
def _imports(source: Path) -> frozenset[str]:
    """Name every module that a file imports; of ``from a import b`` both a and a.b."""
    names: set[str] = set()
    for node in _statements(ast.parse(source.read_text(encoding="utf-8"), str(source))):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            names |= {node.module, *(f"{node.module}.{alias.name}" for alias in node.names)}
    return frozenset(names)


def _statements(module: ast.Module) -> Iterator[ast.AST]:
    """Give all statements of a file, at any depth, but no expressions: those are most of it."""
    waiting: list[ast.AST] = [module]
    while waiting:
        node = waiting.pop()
        yield node
        # What holds statements: bodies, the other branches, handlers of exceptions, cases.
        for block in ("body", "orelse", "handlers", "finalbody", "cases"):
            waiting += getattr(node, block, [])


@cache
def _files_of(modules: frozenset[str], folder: Path) -> frozenset[Path]:
    """Give the local files that importing these modules runs, the packages above included."""
    return frozenset().union(*(_module_files(folder, module) for module in modules))


@cache
def _module_files(folder: Path, module: str) -> frozenset[Path]:
    """Give the files that importing a dotted name runs, the packages above it included."""
    files, path = [], folder
    for part in module.split("."):
        path /= part
        files += [path.with_suffix(".py"), path / "__init__.py"]
    return frozenset(path for path in files if path.is_file())
