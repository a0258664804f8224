"""Read a file in a process of its own, which may crash, or come to no end.

The packages that read binary formats trust the bytes of a file.
"""

import logging
import sys
import warnings
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path
from typing import Any, TypeAlias

from capsule.engine.forks import forked
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


def read_apart(name: str, read: Reader, source: Any, keys: Keys) -> list[Table]:
    """Return the tables in a file, its content or its path, that a function reads.

    Raises
    ------
    CapsuleError
        The file holds no table or cannot be read, or the package that reads it is not installed;
        the message names the format.
    """

    def read_quietly(_: None) -> list[Table]:
        limit_process(name, source)
        # Some packages log their repairs, with the damaged bytes.
        logging.disable(logging.CRITICAL)
        with warnings.catch_warnings():
            # Packages warn about charts, checks and other versions of their format.
            warnings.simplefilter("ignore")
            return list(read(source, keys))

    with ThreadPoolExecutor(1) as pool:
        reading = pool.submit(list, forked(read_quietly, [None], 2))
    fault = reading.exception()
    if isinstance(fault, CapsuleError):
        raise fault
    if isinstance(fault, ModuleNotFoundError):
        raise not_installed(f"the {name} is read by the package {fault.name}", "formats")
    if isinstance(fault, BrokenProcessPool):
        raise CapsuleError(
            "the package that reads this format crashed at it, or came to no end; copy or export "
            "it again"
        )
    if fault:
        reason = in_short(fault)[:_LONGEST_REASON] or type(fault).__name__
        raise CapsuleError(f"the {name} cannot be read ({reason}); copy or export it again")
    (tables,) = reading.result()
    if not tables:
        raise CapsuleError(
            f"the {name} holds no table of numbers, a row for each sample; export the readings so"
        )
    return tables
