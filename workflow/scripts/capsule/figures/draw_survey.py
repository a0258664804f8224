"""The space-time picture of a survey: distance across, time downward.

The capsule's path runs from the upper left to the lower right; where it went back and looked again
it has a sawtooth. Beside it stands the evidence, below it some suspected places, larger.
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

# The rows of a figure's data, and what draws it: it takes the width in inches.
SurveyDrawing = tuple[list[dict[str, Any]], Callable[[float], Figure]]
# More panels of places than these are no picture.
_PLACES_ACROSS, _PLACES_ACROSS_NARROW = 4, 2


def picture_table(track: Track) -> list[dict[str, Any]]:
    """Return the data of the picture, a row a judgement."""
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
    """Give the data of a survey's picture, and what draws it.

    Parameters
    ----------
    session : Session
        The survey.
    title : str
        Its name in words.
    track : Track
        Its judgements.
    pins : sequence of Pin
        When it was busy with each place.
    wave : pair of float
        Wavelength in mm, and where a crest stood when the drive had not carried it yet.
    """
    told = session.about.get("metres")
    length_mm = 1000 * told if isinstance(told, int | float) else 0.0
    known = track.head_mm[track.known]
    length_mm = max([length_mm, *known, *(place.place_mm for place in session.places)])
    picture = SurveyPicture(title, track, session.places, pins, length_mm, *wave)
    return picture_table(track), lambda width_in: draw_survey(picture, width_in)


def unreadable_drawing(name: str, problem: str) -> SurveyDrawing:
    """Give the picture of a survey that cannot be read: it says why."""

    def draw(width_in: float) -> Figure:
        with figure_style():
            figure = Figure(figsize=(width_in, 1.0), layout="constrained")
            axes = figure.subplots()
            text = textwrap.fill(f"{name} cannot be read: {problem}", int(14 * width_in))
            say_nothing_to_show(axes, text)
        return figure

    return [{"problem": problem}], draw


def frames(figure: Figure) -> dict[str, Any]:
    """Return where map and evidence stand in a figure that was rendered.

    Returns
    -------
    dict
        ``size`` in points; of ``map`` and ``evidence`` the ``box`` (left, top, width, height, in
        points from the upper left) and the ends of its axes ``x`` and ``y``. Without a map only
        ``size``.
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
    """Draw the picture; its first axes are the map, its second the evidence.

    Parameters
    ----------
    picture : SurveyPicture
        What it shows.
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
    """Choose the places that have room; nodules come first, and the order is that of the gut."""
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
