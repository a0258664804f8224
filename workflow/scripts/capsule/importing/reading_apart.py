"""Read a file in a process of its own, which may crash, or come to no end.

The packages that read binary formats trust the bytes of a file.
"""

import contextlib
import logging
import os
import pickle
import sys
import warnings
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from importlib import import_module
from pathlib import Path
from typing import Any, TypeAlias

from capsule.engine.project import not_installed
from capsule.errors import CapsuleError
from capsule.importing.lab_yaml import Keys
from capsule.importing.table import Table
from capsule.store.files import in_short

# Seconds of a processor that a file may take, as some packages need one to be imported, and more
# for each MB. The cells of a workbook are read one by one: one that is packed well takes ten.
_SECONDS, _SECONDS_A_MB, _SECONDS_A_MB_OF_CELLS = 4, 5, 30
# Memory that a file may take, and more for the copies of its content.
_BYTES, _COPIES = 800_000_000, 4
_LONGEST_REASON = 100
Reader: TypeAlias = Callable[[Any, Keys], Iterable[Table]]


def limit_process(name: str, source: bytes | Path) -> None:
    """Limit this process to far more time and memory than a file of this format and size needs.

    In a damaged file, a package can follow a chain of addresses that leads back to itself, or
    believe a length of some GB.
    """
    if sys.platform != "linux":
        return  # elsewhere, this process is the command itself
    import resource

    if isinstance(source, bytes):
        size = len(source)
    else:
        size = sum(part.stat().st_size for part in [source, *source.rglob("*")])
    more = _SECONDS_A_MB_OF_CELLS if name == "workbook" else _SECONDS_A_MB
    # What this process has already is not counted: it grows with the processors of the machine.
    pages = int(Path("/proc/self/statm").read_text().split()[5])
    limits = {
        resource.RLIMIT_CPU: int(_SECONDS + more * size / 1e6),
        resource.RLIMIT_DATA: pages * resource.getpagesize() + _BYTES + _COPIES * size,
    }
    for kind, most in limits.items():
        _, hard = resource.getrlimit(kind)
        if hard == resource.RLIM_INFINITY or most < hard:  # a cluster may allow less
            resource.setrlimit(kind, (most, most))


def read_apart(name: str, package: str, read: Reader, source: Any, keys: Keys) -> list[Table]:
    """Return the tables in a file, its content or its path, that a function reads.

    The package that it reads with is imported in this process, so once for all files.

    Raises
    ------
    CapsuleError
        The file holds no table or cannot be read, or the package that reads it is not installed;
        the message names the format.
    """

    def tables() -> bytes:
        limit_process(name, source)
        # Some packages log their repairs, with the damaged bytes.
        logging.disable(logging.CRITICAL)
        return pickle.dumps(list(read(source, keys)))

    def tables_or_refusal() -> bytes:
        with ThreadPoolExecutor(1) as pool:
            reading = pool.submit(tables)
        fault = reading.exception()
        return pickle.dumps(_refusal(name, fault)) if fault else reading.result()

    with warnings.catch_warnings():
        # Packages warn about charts, checks and other versions of their format.
        warnings.simplefilter("ignore")
        with contextlib.suppress(ImportError):  # which the reader tells
            import_module(package)
        forks = sys.platform == "linux"
        content = _of_a_fork(tables_or_refusal) if forks else tables_or_refusal()
    found: list[Table] | CapsuleError = pickle.loads(content)
    if isinstance(found, CapsuleError):
        raise found
    if not found:
        raise CapsuleError(
            f"the {name} holds no table of numbers, a row for each sample; export the readings so"
        )
    return found


def _refusal(name: str, fault: BaseException) -> CapsuleError:
    """Return the error that tells why a file of a format could not be read."""
    if isinstance(fault, CapsuleError):
        return fault
    if isinstance(fault, ModuleNotFoundError):
        return not_installed(f"the {name} is read by the package {fault.name}", "formats")
    reason = in_short(fault)[:_LONGEST_REASON] or type(fault).__name__
    return CapsuleError(f"the {name} cannot be read ({reason}); copy or export it again")


def _of_a_fork(call: Callable[[], bytes]) -> bytes:
    """Return what a call returns in a fork of this process; raise an error if the fork ends."""
    reading, writing = os.pipe()
    fork = os.fork()
    if fork == 0:
        status = 1
        try:
            with os.fdopen(writing, "wb") as stream:
                stream.write(call())
            status = 0
        finally:
            # Whatever happened, nothing of the command goes on here.
            os._exit(status)
    os.close(writing)
    try:
        with os.fdopen(reading, "rb") as stream:
            content = stream.read()
    finally:
        _, status = os.waitpid(fork, 0)
    if status:
        raise CapsuleError(
            "the package that reads this format crashed at it, or came to no end; copy or export "
            "it again"
        )
    return content
