"""Draw the space-time picture of a survey: distance to the right, time downward.

The capsule's path runs from the upper left to the lower right. It has a sawtooth where the capsule
went back and looked again. The evidence is beside the map; enlarged suspected places are below it.
"""

import textwrap
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from capsule import words
from capsule.figures.style import (
    COLUMN_WIDTH_IN,
    MUTED,
    PAGE_WIDTH_IN,
    figure_style,
    say_nothing_to_show,
)
from capsule.figures.survey_panels import (
    LOOKS,
    PIN_LOOKS,
    THRESHOLD,
    UNMEASURED,
    SurveyPicture,
    draw_evidence,
    draw_map,
    draw_place,
)
from capsule.survey.stored_session import Session, StoredPlace
from capsule.survey.track import Pin, Track

# The rows of a figure's data, and a function that draws the figure at a width in inches.
SurveyDrawing = tuple[list[dict[str, Any]], Callable[[float], Figure]]
# Panels of places in one row.
_PLACES_ACROSS, _PLACES_ACROSS_NARROW = 4, 2


def picture_table(track: Track) -> list[dict[str, Any]]:
    """Return the data of the picture, one row per judgement."""
    columns = {
        "time_s": track.time_s.tolist(),
        "head_mm": np.round(track.head_mm, 2).tolist(),
        "measured": track.known.tolist(),
        "state": track.state.tolist(),
        "score": track.score.tolist(),
        "threshold": track.threshold.tolist(),
        "wave_mm": track.wave_mm.tolist(),
    }
    return [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]


def survey_drawing(
    session: Session,
    title: str,
    track: Track,
    pins: Sequence[Pin],
    wave: tuple[float, float],
) -> SurveyDrawing:
    """Return the drawing of a survey: its data, and a function that draws it.

    Parameters
    ----------
    session : Session
        The survey.
    title : str
        Its title.
    track : Track
        Position, state and score at each of its judgements.
    pins : sequence of Pin
        The interval in which it examined each place.
    wave : pair of float
        Wavelength in mm, and the position of a crest in mm before the drive moved the wave.
    """
    told = session.about.get("metres")
    length_mm = 1000 * told if isinstance(told, int | float) else 0.0
    known = track.head_mm[track.known]
    length_mm = max([length_mm, *known, *(place.place_mm for place in session.places)])
    picture = SurveyPicture(title, track, session.places, pins, length_mm, *wave)
    return picture_table(track), lambda width_in: draw_survey(picture, width_in)


def unreadable_drawing(name: str, problem: str) -> SurveyDrawing:
    """Return the drawing of a survey that cannot be read, with the reason."""

    def draw(width_in: float) -> Figure:
        with figure_style():
            figure = Figure(figsize=(width_in, 1.0), layout="constrained")
            axes = figure.subplots()
            text = textwrap.fill(f"{name} cannot be read: {problem}", int(14 * width_in))
            say_nothing_to_show(axes, text)
        return figure

    return [{"problem": problem}], draw


def frames(figure: Figure) -> dict[str, Any]:
    """Return the positions of map and evidence in a rendered figure.

    Returns
    -------
    dict
        ``size`` in points; ``map`` and ``evidence``, each with its ``box`` (left, top, width,
        height, in points from the upper left) and the limits of its axes ``x`` and ``y``. Without
        a map only ``size``.
    """
    width, height = figure.get_size_inches() * 72
    told: dict[str, Any] = {"size": [round(float(width), 2), round(float(height), 2)]}
    for name, axes in zip(("map", "evidence"), figure.axes, strict=False):
        if not axes.xaxis.get_visible() or not len(axes.get_xticks()):
            continue
        box = axes.get_window_extent().transformed(figure.transFigure.inverted())
        told[name] = {
            "box": [
                round(float(part), 2)
                for part in (
                    box.x0 * width, (1 - box.y1) * height, box.width * width, box.height * height
                )
            ],
            "x": [float(end) for end in axes.get_xlim()],
            "y": [float(end) for end in axes.get_ylim()],
        }  # fmt: skip
    return told


def draw_survey(picture: SurveyPicture, width_in: float = PAGE_WIDTH_IN) -> Figure:
    """Draw the picture; its first axes are the map, and its second axes the evidence.

    Parameters
    ----------
    picture : SurveyPicture
        The survey's data.
    width_in : float
        Width of the figure in inches.
    """
    narrow = width_in <= COLUMN_WIDTH_IN
    across = _PLACES_ACROSS_NARROW if narrow else _PLACES_ACROSS
    shown = _places_shown(picture, across * (2 if narrow else 1))
    rows = -(-len(shown) // across)
    map_in, row_in = (3.6 if narrow else 4.0), (1.9 if narrow else 2.15)
    with figure_style():
        figure = Figure(figsize=(width_in, map_in + row_in * rows + 0.35), layout="constrained")
        figure.suptitle(picture.title, x=0.01, ha="left", fontsize=8.5)
        made = figure.subfigures(1 + rows, 1, height_ratios=[map_in, *[row_in] * rows])
        parts = np.atleast_1d(np.asarray(made, dtype=object))
        space, evidence = parts[0].subplots(
            1, 2, sharey=True, width_ratios=[3.4 if narrow else 4.6, 1]
        )
        if picture.track.time_s.size == 0 or not picture.track.known.any():
            say_nothing_to_show(space, "the survey never knew where the capsule was")
            say_nothing_to_show(evidence, "")
            return figure
        draw_map(space, picture, narrow=narrow)
        draw_evidence(evidence, picture)
        for row in range(rows):
            panels = parts[1 + row].subplots(1, across, squeeze=False)[0]
            for axes in panels[len(shown[row * across :]) :]:
                axes.set_visible(False)
            for axes, (place, pin) in zip(panels, shown[row * across :], strict=False):
                draw_place(axes, picture, place, pin)
            panels[0].set_ylabel("time (s)")
        _add_legend(figure, picture, narrow=narrow)
    return figure


def _places_shown(picture: SurveyPicture, most: int) -> list[tuple[StoredPlace, Pin]]:
    """Return the places that have room, nodules before others, in the order of their numbers."""
    order = {"confirmed": 0, "undecided": 1, "dismissed": 2}
    pairs = list(zip(picture.places, picture.pins, strict=False))
    pairs.sort(key=lambda pair: (order[pair[0].status], -_known_or_zero(pair[0].height)))
    return sorted(pairs[:most], key=lambda pair: pair[0].number)


def _known_or_zero(value: float) -> float:
    return value if words.is_known(value) else 0.0


def _add_legend(figure: Figure, picture: SurveyPicture, *, narrow: bool) -> None:
    handles = [Line2D([], [], **look) for look in LOOKS.values()]
    handles.append(Line2D([], [], color=MUTED, linestyle=UNMEASURED, label="position not measured"))
    handles.append(Line2D([], [], label="threshold of suspicion", **THRESHOLD))
    handles += [
        line for line in figure.axes[0].get_lines() if str(line.get_label()).startswith("crest")
    ]
    present = {place.status for place in picture.places}
    handles += [
        Line2D([], [], label=status, **look)
        for status, look in PIN_LOOKS.items()
        if status in present
    ]
    figure.legend(
        handles=handles, loc="outside lower center", ncols=2 if narrow else 4, handlelength=2.4
    )
