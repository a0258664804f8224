"""One recording as a detector judges it: readings, envelope and matrix, with the place marked."""

import io
from collections.abc import Mapping, Sequence

from matplotlib.figure import Figure

from capsule import words
from capsule.figures.draw_preprocessing import draw_preprocessing
from capsule.figures.style import DETECTOR_LOOKS, figure_style, render_figure
from capsule.kinds import Look
from capsule.stages import PreprocessedRun

_DOTS_PER_INCH = 200
# Room above the readings for the names of the places.
_HEADROOM = 0.3


def draw_judged(
    run: PreprocessedRun, threshold: float, places_s: Mapping[float, Sequence[str]]
) -> Figure:
    """Draw a recording and where along it the detectors find a nodule.

    Parameters
    ----------
    run : PreprocessedRun
        The recording; its title says what the detectors made of it.
    threshold : float
        c, drawn over the envelopes, in standard deviations.
    places_s : mapping of float to sequence of str
        When sensor 1 passes the nodule, in seconds, and the detectors that say so.

    Returns
    -------
    Figure
    """
    figure = draw_preprocessing([run], threshold)
    signal, envelope, matrix = figure.axes[:3]
    with figure_style():
        marks = []
        for number, (place, names) in enumerate(places_s.items()):
            look = DETECTOR_LOOKS[number % len(DETECTOR_LOOKS)]
            line: Look = {"color": look["color"], "linestyle": look["linestyle"], "linewidth": 1.2}
            label = f"place by {words.enumerate_words(names)}: {words.place(place, None)}"
            marks.append(signal.axvline(place, label=label, **line))
            for axes in (envelope, matrix):
                axes.axvline(place, **line)
        low, high = signal.get_ylim()
        signal.set(title=run.title, ylim=(low, high + _HEADROOM * (high - low)))
        if marks:
            signal.legend(handles=marks, loc="upper right", ncols=len(marks), borderaxespad=0)
    return figure


def picture_bytes(figure: Figure, kind: str, name: str) -> bytes:
    """Make a file's content of a figure.

    Parameters
    ----------
    figure : Figure
        As `draw_judged` gives it.
    kind : {"png", "svg"}
        The format.
    name : str
        Title in the file.
    """
    if kind == "svg":
        return render_figure(figure, kind, name)
    stream = io.BytesIO()
    with figure_style():
        figure.savefig(stream, format=kind, dpi=_DOTS_PER_INCH)
    return stream.getvalue()
