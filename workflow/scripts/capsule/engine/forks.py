"""Call a function in forks of this process, which share what it has read and imported."""

import os
import sys
import threading
import warnings
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context, parent_process
from typing import TypeVar, cast

from threadpoolctl import threadpool_limits

Part = TypeVar("Part")
Result = TypeVar("Result")
# What the forks call. A fork of this process finds it here, so it need not be pickled.
_CALLED: list[Callable[..., object]] = []


def forked(
    function: Callable[[Part], Result], parts: Iterable[Part], processes: int
) -> Iterator[Result]:
    """Yield the function's result for each part, in the order of the parts.

    On systems without safe forks, and with one process, the calls run in this process. From now on
    this process and its forks compute with one thread each: two forks with two threads each hinder
    one another, and more threads add in another order.

    Parameters
    ----------
    function : callable
        ``function(part)``.
    parts : iterable
        The parts of the work.
    processes : int
        Number of forks that work at a time. It does not change the results.
    """
    threadpool_limits(limits=1)
    if processes < 2 or sys.platform != "linux":
        yield from map(function, parts)
        return
    _CALLED.append(function)
    pool = ProcessPoolExecutor(processes, get_context("fork"), initializer=_end_with_starter)
    try:
        with warnings.catch_warnings(), pool:
            # The other thread belongs to the memory allocator of pyarrow.
            about = "This process .* is multi-threaded"
            warnings.filterwarnings("ignore", about, DeprecationWarning)
            for result in pool.map(_call, parts):
                yield cast(Result, result)
    finally:
        _CALLED.pop()


def _call(part: object) -> object:
    return _CALLED[-1](part)


def _end_with_starter() -> None:
    """End this process as soon as the process that has started it ends, even by a signal.

    Without it, the processes of an executor would wait for work forever.
    """
    starter = parent_process()
    assert starter is not None

    def wait() -> None:
        starter.join()
        os._exit(1)

    threading.Thread(target=wait, daemon=True).start()
