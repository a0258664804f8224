"""Write figures in the widths of one and of two columns, with their data as CSV."""

import os
import sys
import threading
import warnings
from collections.abc import Iterable
from concurrent.futures import ProcessPoolExecutor
from itertools import starmap
from multiprocessing import get_context, parent_process
from pathlib import Path

from capsule.figures.inputs import Drawing, FigureInputs, make_drawing
from capsule.figures.style import COLUMN_WIDTH_IN, PAGE_WIDTH_IN, render_figure
from edges import files

_WIDTHS = ((PAGE_WIDTH_IN, ""), (COLUMN_WIDTH_IN, "_column"))
# The figures to draw. A fork of this process finds them here.
_DRAWINGS: dict[str, Drawing] = {}


def write_figures(
    names: Iterable[str], inputs: FigureInputs, kind: str, folder: Path, processes: int = 1
) -> None:
    """Draw figures of `capsule.figures.registry` and write them.

    Parameters
    ----------
    names : iterable of str
        Names of the figures.
    inputs : FigureInputs
        The results that the figures show.
    kind : {"svg", "pdf"}
        The file format.
    folder : Path
        Folder for ``<figure>.<kind>``, ``<figure>_column.<kind>`` and ``<figure>.csv``.
    processes : int
        Number of processes that draw at a time. It does not change the files.
    """
    for name in names:
        _DRAWINGS[name] = table, _ = make_drawing(name, inputs)
        with files.write_whole(folder / f"{name}.csv") as stream:
            table.to_csv(stream, index=False, lineterminator="\n")
        print(f"{name}: {len(table)} rows of data")
    pictures = [(name, *width, kind) for name in _DRAWINGS for width in _WIDTHS]
    if processes > 1 and sys.platform == "linux":  # other systems have no safe forks
        _write_by_forks(pictures, folder, processes)
    else:
        _write(starmap(_render, pictures), folder)
    _DRAWINGS.clear()


def _write_by_forks(
    pictures: Iterable[tuple[str, float, str, str]], folder: Path, processes: int
) -> None:
    """Draw in forks of this process, which has imported matplotlib already."""
    forks = ProcessPoolExecutor(processes, get_context("fork"), initializer=end_with_starter)
    with warnings.catch_warnings(), forks as pool:
        # The other thread belongs to the memory allocator of pyarrow.
        about = "This process .* is multi-threaded"
        warnings.filterwarnings("ignore", about, DeprecationWarning)
        _write(pool.map(_render, *zip(*pictures, strict=True)), folder)


def end_with_starter() -> None:
    """End this process as soon as the process that has started it ends, even by a signal.

    Without it, the processes of an executor would wait for work forever.
    """
    starter = parent_process()
    assert starter is not None

    def wait() -> None:
        starter.join()
        os._exit(1)

    threading.Thread(target=wait, daemon=True).start()


def _render(name: str, width_in: float, suffix: str, kind: str) -> tuple[str, bytes]:
    """Return the name and the content of a figure's file."""
    _, draw = _DRAWINGS[name]
    return f"{name}{suffix}.{kind}", render_figure(draw(width_in), kind, name + suffix)


def _write(pictures: Iterable[tuple[str, bytes]], folder: Path) -> None:
    for name, content in pictures:
        with files.write_whole(folder / name, "wb") as stream:
            stream.write(content)
