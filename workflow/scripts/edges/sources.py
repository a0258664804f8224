"""Which files a script's result depends on: itself and the library modules that it imports.

Imports nothing heavy: the Snakefile asks at every start.
"""

import ast
from functools import cache
from pathlib import Path


def imported_files(script: Path) -> list[Path]:
    """Find the local modules that a script imports, directly or through one another.

    Parameters
    ----------
    script : Path
        A script; modules are looked for beside it, in the folder of the library's package.

    Returns
    -------
    list of Path
        Sorted, without the script itself; what is not found beside it belongs to Python or an
        installed package.
    """
    found: set[Path] = set()
    waiting = [script]
    while waiting:
        for module in _imports(waiting.pop()):
            for path in _module_files(script.parent, module):
                if path not in found and path != script:
                    found.add(path)
                    waiting.append(path)
    return sorted(found)


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
    files, place = [], folder
    for part in module.split("."):
        place /= part
        files += [place.with_suffix(".py"), place / "__init__.py"]
    return [path for path in files if path.is_file()]
