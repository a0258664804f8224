"""Write a figure with its data: for the page, or for print in the widths of one and two columns."""

from collections.abc import Callable
from importlib import import_module
from pathlib import Path

from capsule.figures.inputs import FigureInputs
from capsule.figures.registry import FIGURES
from capsule.figures.style import PAGE_WIDTH_IN, WIDTHS_IN, Drawing, render_figure
from capsule.store import files


def write_figure(name: str, inputs: FigureInputs, kind: str, folder: Path) -> str:
    """Draw a figure of `capsule.figures.registry`, write it with its data, and return a log line.

    A PDF is written in the widths of one and of two columns.
    """
    module = import_module(FIGURES[name])
    make: Callable[[FigureInputs], Drawing] = getattr(module, f"{name}_drawing")
    table, draw = make(inputs)
    with files.write_whole(folder / f"{name}.csv") as stream:
        table.to_csv(stream, index=False, lineterminator="\n")
    widths_in = WIDTHS_IN if kind == "pdf" else {"": PAGE_WIDTH_IN}
    for suffix, width_in in widths_in.items():
        picture = render_figure(draw(width_in), kind, name + suffix)
        with files.write_whole(folder / f"{name}{suffix}.{kind}", "wb") as stream:
            stream.write(picture)
    return f"{name}: {len(table)} rows of data"
