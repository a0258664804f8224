"""Write figures in the widths of one and of two columns, with their data as CSV."""

from collections.abc import Iterable
from pathlib import Path

from capsule.figures.inputs import FigureInputs, make_drawing
from capsule.figures.style import COLUMN_WIDTH_IN, PAGE_WIDTH_IN, render_figure
from edges import files

_WIDTHS = ((PAGE_WIDTH_IN, ""), (COLUMN_WIDTH_IN, "_column"))


def write_figures(names: Iterable[str], inputs: FigureInputs, kind: str, folder: Path) -> None:
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
    """
    for name in names:
        table, draw = make_drawing(name, inputs)
        with files.write_whole(folder / f"{name}.csv") as stream:
            table.to_csv(stream, index=False, lineterminator="\n")
        for width_in, suffix in _WIDTHS:
            picture = render_figure(draw(width_in), kind, name + suffix)
            with files.write_whole(folder / f"{name}{suffix}.{kind}", "wb") as stream:
                stream.write(picture)
        print(f"{name}: {len(table)} rows of data")
