"""Write figures in the widths of one and of two columns, with their data as CSV."""

import multiprocessing
from collections.abc import Iterable
from itertools import starmap
from pathlib import Path

from capsule.figures.inputs import Drawing, FigureInputs, make_drawing
from capsule.figures.style import COLUMN_WIDTH_IN, PAGE_WIDTH_IN, render_figure
from edges import files

_WIDTHS = ((PAGE_WIDTH_IN, ""), (COLUMN_WIDTH_IN, "_column"))
# The figures at hand. Processes that are forks of this one find them here, too.
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
    # A fork has imported matplotlib already. Where there are no forks, one process draws all.
    if processes > 1 and "fork" in multiprocessing.get_all_start_methods():
        with multiprocessing.get_context("fork").Pool(processes) as pool:
            _write(folder, pool.starmap(_render, pictures, chunksize=1))
    else:
        _write(folder, starmap(_render, pictures))
    _DRAWINGS.clear()


def _render(name: str, width_in: float, suffix: str, kind: str) -> tuple[str, bytes]:
    """Return the name and the content of a figure's file."""
    _, draw = _DRAWINGS[name]
    return f"{name}{suffix}.{kind}", render_figure(draw(width_in), kind, name + suffix)


def _write(folder: Path, pictures: Iterable[tuple[str, bytes]]) -> None:
    for name, content in pictures:
        with files.write_whole(folder / name, "wb") as stream:
            stream.write(content)
