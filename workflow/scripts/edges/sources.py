"""Which files a script's result depends on: itself and the library modules that it imports.

Imports nothing heavy: the Snakefile asks at every start.
"""

import ast
from collections.abc import Iterable
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
    reached = {script}
    waiting = [script]
    for module in modules:
        waiting += _module_files(folder, module)
    while waiting:
        source = waiting.pop()
        reached.add(source)
        for module in _imports(source):
            waiting += [path for path in _module_files(folder, module) if path not in reached]
    return sorted(reached - {script})


@cache
def _imports(source: Path) -> frozenset[str]:
    """Name every module that a file imports; of ``from a import b`` both a and a.b."""
    names: set[str] = set()
    for node in ast.walk(ast.parse(source.read_text(encoding="utf-8"), str(source))):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            names |= {node.module, *(f"{node.module}.{alias.name}" for alias in node.names)}
    return frozenset(names)


def _module_files(folder: Path, module: str) -> list[Path]:
    """Give the files that importing a dotted name runs, the packages above it included."""
    files, path = [], folder
    for part in module.split("."):
        path /= part
        files += [path.with_suffix(".py"), path / "__init__.py"]
    return [path for path in files if path.is_file()]
