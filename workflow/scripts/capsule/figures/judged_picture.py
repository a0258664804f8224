"""Draw one recording as detectors judge it: readings, envelope, matrix, and the nodule's place."""

import io
from collections.abc import Mapping, Sequence

from matplotlib.figure import Figure

from capsule import words
from capsule.figures.draw_preprocessing import draw_preprocessing
from capsule.figures.style import DETECTOR_LOOKS, figure_style, render_figure
from capsule.kinds import Look
from capsule.preprocessing import PreprocessedRun

_DOTS_PER_INCH = 200
# Room above the readings for the legend, as a share of the readings' range.
_HEADROOM = 0.3


def draw_judged(
    run: PreprocessedRun, threshold: float, places_s: Mapping[float, Sequence[str]]
) -> Figure:
    """Draw a recording, with lines where the detectors find a nodule.

    Parameters
    ----------
    run : PreprocessedRun
        The recording; its title gives the detectors' verdicts.
    threshold : float
        c, drawn over the envelopes, in standard deviations.
    places_s : mapping of float to sequence of str
        The detectors that find a nodule, by the time in s at which sensor 1 passes it.

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
    """Return a figure as the content of a file.

    Parameters
    ----------
    figure : Figure
        From `draw_judged`.
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
