"""Write a figure in the widths of one and of two columns, with its data."""

from collections.abc import Callable
from importlib import import_module
from pathlib import Path

from capsule.figures.inputs import FigureInputs
from capsule.figures.registry import FIGURES
from capsule.figures.style import WIDTHS_IN, Drawing, render_figure
from capsule.store import files


def write_figure(name: str, inputs: FigureInputs, kind: str, folder: Path) -> str:
    """Draw a figure of `capsule.figures.registry` and write it, with its data.

    Parameters
    ----------
    name : str
        The figure.
    inputs : FigureInputs
        The results that the figures show.
    kind : {"svg", "pdf"}
        The file format.
    folder : Path
        Folder for ``<figure>.<kind>``, ``<figure>_column.<kind>`` and ``<figure>.csv``.

    Returns
    -------
    str
        A line for the log.
    """
    row = FIGURES[name]
    make: Callable[[FigureInputs], Drawing] = getattr(import_module(row.module), row.made_by)
    table, draw = make(inputs)
    with files.write_whole(folder / f"{name}.csv") as stream:
        table.to_csv(stream, index=False, lineterminator="\n")
    for suffix, width_in in WIDTHS_IN.items():
        picture = render_figure(draw(width_in), kind, name + suffix)
        with files.write_whole(folder / f"{name}{suffix}.{kind}", "wb") as stream:
            stream.write(picture)
    return f"{name}: {len(table)} rows of data"
