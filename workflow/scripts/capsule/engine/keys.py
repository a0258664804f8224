"""The key of each job: a checksum of its code, its settings and the keys of its inputs.

A key is a pure function of what a result depends on, so it changes exactly with that, whatever the
time stamps. It is a parameter of the job's rule, and Snakemake makes a result again if its key
differs from the one before. The key of a recording is the checksum of its content.

If a job fails, those after it keep their old keys. So the next run makes them, misses their input,
and makes the failed job again.

The Snakefile uses this module at every start, so it imports only fast modules.
"""

import hashlib
import os
import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cache
from pathlib import Path

_COMMENT_OR_CONTINUATION = re.compile(r"#.*|\\\r?\n")
# Both branches begin with a letter, which Python finds much faster than the boundary of a word.
_IMPORT = re.compile(
    r"(?:from(\s+\w[\w.]*\s|\s*\.[.\s]*[\w.]*?)\s*import\s*|import\s+)(\([^)]*\)|[^\n;]*)"
)


# Of a checksum: 80 bits are enough, and fit on a line of Snakemake's log.
_DIGITS = 20
# The folder of this package. An installed library is not beside the scripts.
_LIBRARY = Path(__file__).resolve().parents[2].as_posix()


@dataclass(frozen=True)
class Step:
    """A rule's script and settings, which together with its inputs give the keys of its jobs.

    Attributes
    ----------
    name : str
        The rule.
    script : Path
        Its script.
    settings : str
        Its settings, as JSON text.
    code : str
        The name and the checksum of its code, from `checksum_of_code`.
    inputs : callable
        ``inputs(batch)`` returns the keys of the inputs of the job of a batch. A rule with a single
        job has the batch ``""``.
    """

    name: str
    script: Path
    settings: str
    code: str
    inputs: Callable[[str], Iterable[str]]

    @cache  # noqa: B019 (the steps live as long as the program)
    def key(self, batch: str = "") -> str:
        """Return the key of the job of a batch."""
        return combined([self.name, self.settings, self.code, *self.inputs(batch)])


def combined(parts: Iterable[str]) -> str:
    """Return one checksum of several texts, none of which holds a null character."""
    return hashlib.sha256("\0".join(parts).encode()).hexdigest()[:_DIGITS]


def checksum_of_code(files: Iterable[Path]) -> str:
    """Return the name of a script and the checksum of its code, from `files_of_code`."""
    paths = list(files)
    parts = [hashlib.sha256(read_code(path.as_posix())).hexdigest() for path in paths]
    return f"{paths[0].name} {combined(parts)}"


def files_of_code(
    script: Path, modules: Iterable[str] = (), beside: Iterable[Path] = ()
) -> list[Path]:
    """Return the files that a step's code is: the script, what it imports, and what it reads.

    `modules` are further ones, which the script imports by the names in a registry; `beside` are
    other files that it reads, such as templates and weights.
    """
    return [script, *imported_files(script, modules), *beside]


def imported_files(script: Path, modules: Iterable[str] = ()) -> list[Path]:
    """Return the sorted files of the local modules that a script imports, directly or indirectly.

    Local modules lie in the script's folder, and the package capsule there or installed. `modules`
    are further ones, which the script imports by the names in a registry. The script itself, and
    Python's modules and other installed packages, are left out.
    """
    # Many scripts reach the same files, and texts are compared much faster than paths.
    folder, start = script.parent.as_posix(), script.as_posix()
    waiting = {start, *_files_of(frozenset(modules), folder)}
    reached = set()
    while waiting:
        source = waiting.pop()
        reached.add(source)
        root = folder if source.startswith(f"{folder}/") else _LIBRARY
        waiting |= _files_of(_imports(source, root), folder) - reached
    return sorted(map(Path, reached - {start}))


@cache
def read_code(source: str) -> bytes:
    """Return the content of a code file; the cache reads it once for all scripts that import it."""
    return Path(source).read_bytes()


@cache
def _imports(source: str, root: str) -> frozenset[str]:
    """Return the modules that a file below a root imports; for ``from a import b`` both a and a.b.

    Parsing each file would take 15 times as long. Words in a docstring that look like an import can
    add a name, but no import is missed.
    """
    text = _COMMENT_OR_CONTINUATION.sub(" ", read_code(source).decode("utf-8"))
    names: set[str] = set()
    for package, listed in _IMPORT.findall(text):
        parts = [part.split()[0] for part in listed.strip(" ()").split(",") if part.strip()]
        package = _absolute("".join(package.split()), source, root)
        names |= {package, *(f"{package}.{part}" for part in parts)} if package else {*parts}
    return frozenset(names)


def _absolute(package: str, source: str, root: str) -> str:
    """Return the name of a package that a file names; leading dots count from the file's folder."""
    named = package.lstrip(".")
    if named == package:
        return package
    above = source.removeprefix(f"{root}/").split("/")[: len(named) - len(package)]
    return ".".join([*above, *filter(None, [named])])


@cache
def _files_of(modules: frozenset[str], folder: str) -> frozenset[str]:
    """Return the local files that run when these modules are imported, with their packages."""
    return frozenset().union(*(_module_files(folder, module) for module in modules))


@cache
def _module_files(folder: str, module: str) -> frozenset[str]:
    """Return the files that run when a dotted name is imported, with the packages above it."""
    package = module.rpartition(".")[0]
    above = _module_files(folder, package) if package else frozenset()
    if module.partition(".")[0] == "capsule" and not Path(folder, "capsule").is_dir():
        folder = _LIBRARY
    path = f"{folder}/{module.replace('.', '/')}"
    return above.union(filter(os.path.isfile, (f"{path}.py", f"{path}/__init__.py")))
