"""Set the look that all figures share, and write figures as files.

Lightness and shape show every difference, and colour repeats it. So the figures stay readable in
greyscale and with any colour vision. The font comes with matplotlib, so that every machine draws
the same bytes.
"""

import contextlib
import io
import itertools
import re
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import matplotlib
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure

from capsule.kinds import Look

# A figure's data, and a function that draws the figure at a width in inches.
Drawing = tuple[pd.DataFrame, Callable[[float], Figure]]

# Widths of one and of two columns of an IEEE journal, in inches.
COLUMN_WIDTH_IN = 3.5
PAGE_WIDTH_IN = 7.16
_DOTS_PER_INCH = 200

INK = "#1a1a1a"
MUTED = "#6b6b6b"
BLUE = "#0072b2"
ORANGE = "#c34a00"
GREEN = "#2a7f62"
DARK_GREEN = "#0f5a42"
GREY = "#8a8a8a"
VIOLET = "#9b6fb0"
# From white to dark, so that zero is white in print, too.
COLOURS_OF_HEIGHT = "Blues"
# One line per sensor, from dark to light, each with its own dashes.
SENSOR_COLOURS = ("#08306b", ORANGE, GREEN, VIOLET, MUTED)
SENSOR_DASHES = ("-", (0, (5, 1.5)), (0, (1.5, 1.2)), (0, (6, 1.5, 1.2, 1.5)), "-")
# Colour, dashes and marker of a detector, by its position in the configuration.
DETECTOR_LOOKS: tuple[Look, ...] = (
    {"color": ORANGE, "linestyle": (0, (5, 1.5)), "marker": "D"},
    {"color": BLUE, "linestyle": "-", "marker": "o"},
    {"color": DARK_GREEN, "linestyle": (0, (6, 1.5, 1.2, 1.5)), "marker": "^"},
    {"color": VIOLET, "linestyle": (0, (3, 1)), "marker": "v"},
    {"color": INK, "linestyle": (0, (1.5, 1.2)), "marker": "s"},
)
# The paper's printed numbers belong to no detector here, so their marker is hollow.
PAPER_LOOK = {"color": GREY, "marker": "s", "markerfacecolor": "white"}

# Any, because matplotlib's types list every allowed key.
_SETTINGS: dict[Any, object] = {
    "font.family": "DejaVu Sans",
    **dict.fromkeys(("font.size", "axes.labelsize"), 7.5),
    "axes.titlesize": 8,
    **dict.fromkeys(("xtick.labelsize", "ytick.labelsize", "legend.fontsize"), 7),
    **dict.fromkeys(("text.color", "axes.edgecolor", "axes.labelcolor"), INK),
    **dict.fromkeys(("xtick.color", "ytick.color"), INK),
    "axes.titlelocation": "left",
    # Where titles stand anyway; matplotlib need not search for it.
    "axes.titley": 1.0,
    **dict.fromkeys(("axes.linewidth", "xtick.major.width", "ytick.major.width"), 0.6),
    **dict.fromkeys(("axes.spines.top", "axes.spines.right", "legend.frameon"), False),
    "axes.axisbelow": True,
    "lines.linewidth": 1.0,
    "grid.color": "#d9d9d9",
    "grid.linewidth": 0.5,
    # Letters are outlines in SVG and embedded TrueType in PDF, so that no reader needs the font.
    "svg.fonttype": "path",
    "pdf.fonttype": 42,
    "pdf.compression": 9,
}


@contextlib.contextmanager
def figure_style() -> Iterator[None]:
    """Use the shared style inside the context, and restore matplotlib's settings after it."""
    with matplotlib.rc_context():
        matplotlib.rcdefaults()
        matplotlib.rcParams.update(_SETTINGS)
        yield


@contextlib.contextmanager
def new_figure(width_in: float, height_in: float) -> Iterator[Figure]:
    """Give a new figure of this size, with the shared style inside the context."""
    with figure_style():
        yield Figure(figsize=(width_in, height_in), layout="constrained")


def render_figure(figure: Figure, kind: str, name: str) -> bytes:
    """Return a figure, drawn within `figure_style`, as the content of an SVG, PDF or PNG file.

    The same figure gives the same bytes: identifiers inside an SVG are derived from its name.
    """
    stream = io.BytesIO()
    with figure_style(), matplotlib.rc_context({"svg.hashsalt": name}):
        if kind == "png":
            figure.savefig(stream, format=kind, dpi=_DOTS_PER_INCH)
            return stream.getvalue()
        if (layout := figure.get_layout_engine()) is not None:
            layout.execute(figure)
            figure.set_layout_engine("none")
        if kind == "pdf":
            figure.savefig(stream, format=kind, metadata={"CreationDate": None, "Title": name})
            return stream.getvalue()
        # `savefig` is slower: it first draws everything without writing it.
        FigureCanvasSVG(figure).print_svg(stream, metadata={"Date": None, "Title": name})
    return _shorten_coordinates(stream.getvalue())


def _shorten_coordinates(svg: bytes) -> bytes:
    """Round the coordinates of paths to 0.1 point, a thirtieth of a millimetre."""

    def shorten_path(path: re.Match[bytes]) -> bytes:
        shorter = re.sub(rb"-?\d+\.\d{2,}", lambda number: b"%.1f" % float(number[0]), path[0])
        return re.sub(rb"\s+", b" ", shorter)

    return re.sub(rb' d="[^"]*"', shorten_path, svg)


def say_nothing_to_show(axes: Axes, reason: str) -> None:
    """Write a reason into empty axes, and hide their ticks: others may share these."""
    axes.tick_params(left=False, labelleft=False, bottom=False, labelbottom=False)
    axes.text(0.5, 0.5, reason, transform=axes.transAxes, ha="center", va="center", color=MUTED)


def detector_looks(detectors: Sequence[str]) -> dict[str, Look]:
    """Return colour, dashes and marker of each detector, in the order of the configuration."""
    return dict(zip(detectors, itertools.cycle(DETECTOR_LOOKS), strict=False))


def panels_in_rows(
    figure: Figure, count: int, across: int, x_label: str, y_label: str, *, sharex: bool = True
) -> list[Axes]:
    """Return the panels of a figure with shared scales; only the outer ones are labelled."""
    rows = -(-count // across)
    grid = figure.subplots(rows, across, squeeze=False, sharex=sharex, sharey=True).ravel()
    for axes in grid[count:]:
        axes.set_visible(False)
    for axes in grid[max(count - across, 0) : count]:
        axes.set_xlabel(x_label)
        axes.tick_params(labelbottom=True)
    for axes in grid[:count:across]:
        axes.set_ylabel(y_label)
    return list(grid[:count])


def add_legend(figure: Figure, panels: Sequence[Axes], **look: float) -> None:
    """Add one legend below a figure, with each label of the panels once; none without a label."""
    handles: dict[str, Any] = {}
    for axes in panels:
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True):
            handles.setdefault(label, handle)
    if handles:
        names, marks = list(handles), list(handles.values())
        # A letter takes about 0.055 in, and the line beside a label 0.5 in.
        columns = int(figure.get_figwidth() / (0.5 + 0.055 * max(map(len, names))))
        figure.legend(marks, names, loc="outside lower center", ncols=max(columns, 1), **look)
