"""Write figures in the widths of one and of two columns, with their data as CSV."""

from collections.abc import Iterable
from pathlib import Path

from capsule.figures.inputs import FigureInputs, make_drawing
from capsule.figures.style import COLUMN_WIDTH_IN, PAGE_WIDTH_IN, render_figure
from edges import files
from edges.forks import Forks

_WIDTHS = ((PAGE_WIDTH_IN, ""), (COLUMN_WIDTH_IN, "_column"))


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
    draws = {}
    for name in names:
        table, draws[name] = make_drawing(name, inputs)
        with files.write_whole(folder / f"{name}.csv") as stream:
            table.to_csv(stream, index=False, lineterminator="\n")
        print(f"{name}: {len(table)} rows of data")
    pictures = [(name, *width) for name in draws for width in _WIDTHS]

    def render(picture: tuple[str, float, str]) -> bytes:
        name, width_in, suffix = picture
        return render_figure(draws[name](width_in), kind, name + suffix)

    contents = Forks(processes)(render, pictures)
    for (name, _, suffix), content in zip(pictures, contents, strict=True):
        with files.write_whole(folder / f"{name}{suffix}.{kind}", "wb") as stream:
            stream.write(content)
