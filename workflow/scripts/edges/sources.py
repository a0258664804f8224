"""Find the code files that a script's result depends on: the local modules that it imports.

The Snakefile uses this module at every start, so it imports only fast modules.
"""

import re
from collections.abc import Iterable
from functools import cache
from pathlib import Path

_COMMENT_OR_CONTINUATION = re.compile(r"#.*|\\\n")
_IMPORT = re.compile(r"\b(?:from\s+(\w[\w.]*)\s+)?import\s+(\([^)]*\)|[^\n;]*)")


def imported_files(script: Path, modules: Iterable[str] = ()) -> list[Path]:
    """Return the files of the local modules that a script imports, directly or indirectly.

    Parameters
    ----------
    script : Path
        A script; local modules lie in its folder.
    modules : iterable of str
        Names of further modules, which the script imports by the names in a registry.

    Returns
    -------
    list of Path
        Sorted paths, without the script itself, Python's modules and installed packages.
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
    """Return the modules that a file imports; for ``from a import b`` both a and a.b.

    Parsing each file would take 15 times as long. Words in a docstring that look like an import can
    add a name, but no import is missed.
    """
    text = _COMMENT_OR_CONTINUATION.sub(" ", source.read_text(encoding="utf-8"))
    names: set[str] = set()
    for package, listed in _IMPORT.findall(text):
        parts = [part.split()[0] for part in listed.strip("()").split(",") if part.strip()]
        names |= {package, *(f"{package}.{part}" for part in parts)} if package else {*parts}
    return frozenset(names)


@cache
def _files_of(modules: frozenset[str], folder: Path) -> frozenset[Path]:
    """Return the local files that run when these modules are imported, with their packages."""
    return frozenset().union(*(_module_files(folder, module) for module in modules))


@cache
def _module_files(folder: Path, module: str) -> frozenset[Path]:
    """Return the files that run when a dotted name is imported, with the packages above it."""
    files, path = [], folder
    for part in module.split("."):
        path /= part
        files += [path.with_suffix(".py"), path / "__init__.py"]
    return frozenset(path for path in files if path.is_file())
