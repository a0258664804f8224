"""Draw the space-time picture of a survey: distance to the right, time downward.

The capsule's path runs from the upper left to the lower right. It has a sawtooth where the capsule
went back and looked again. The evidence is beside the map; enlarged suspected places are below it.
"""

import textwrap
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from capsule.arrays import FloatArray
from capsule.detectors.verdicts import OF_SURVEY
from capsule.figures import style
from capsule.kinds import Look
from capsule.survey.files import Session, StoredPlace
from capsule.survey.track import AGAIN, AHEAD, BACK, Pin, Track, group_of

# One look per group of states; the path is dashed where the position was not measured.
_LOOKS: dict[str, Look] = {
    AHEAD: {"color": style.BLUE, "linewidth": 1.1, "label": "travels ahead"},
    BACK: {"color": style.ORANGE, "linewidth": 1.1, "label": "folds, is pushed back, unfolds"},
    AGAIN: {"color": style.INK, "linewidth": 1.9, "label": "finds its position, passes again"},
}
_UNMEASURED: Look = {"linestyle": (0, (2.2, 1.4))}
_PIN = {"color": style.INK, "markersize": 5, "markeredgewidth": 0.9, "linestyle": "none"}
# By status, those first that are shown if there is no room for all places.
_PIN_LOOKS: dict[str, Look] = {
    "confirmed": {**_PIN, "marker": "o", "markerfacecolor": style.INK},
    "undecided": {**_PIN, "marker": "D", "markerfacecolor": "#ffffff"},
    "dismissed": {**_PIN, "marker": "o", "markerfacecolor": "#ffffff"},
}
_WAVE = "#b9c2cc"
# With more waves, the lines merge into a grey area.
_WAVES = 24
# The distance and time that a place's panel shows around the place.
_BEFORE_MM, _BEHIND_MM, _BEFORE_MIN, _BEHIND_MIN = 22.0, 30.0, 0.4, 0.33
_MARGIN_MM, _FARTHEST_MM = 3.0, 90.0
_POINTS_OF_EVIDENCE = 300
# Of the picture: places side by side, and the heights of the map and of the row of places.
_ACROSS, _MAP_IN, _ROW_IN = 4, 4.0, 2.15
# Least distance between the map's labels, and approximate height of the map, in points.
_LABEL_PT, _MAP_PT = 9.5, 220


@dataclass(frozen=True)
class _Picture:
    """What the panels of a survey's picture show; `length_mm` is the length of the distance."""

    track: Track
    time_min: FloatArray
    # The suspected places, and the interval in which the survey examined each.
    places: Sequence[tuple[StoredPlace, Pin]]
    length_mm: float
    # Length of the wave, and a crest before the drive moved it; NaN if no wave was felt.
    wavelength_mm: float
    crest_mm: float


def track_table(track: Track) -> pd.DataFrame:
    """Return the data of a survey's picture, with a row per judgement."""
    table = pd.DataFrame(vars(track)).rename(columns={"known": "measured"})
    return table.round({"head_mm": 2})


def draw_note(text: str) -> Figure:
    """Draw why a survey has no picture."""
    with style.new_figure(style.PAGE_WIDTH_IN, 1.0) as figure:
        style.say_nothing_to_show(figure.subplots(), textwrap.fill(text, 100))
    return figure


def frame_of(figure: Figure) -> dict[str, Any]:
    """Return the positions of map and evidence in a rendered figure.

    A box is left, top, width, height, in points from the upper left; x and y are the limits of the
    axes. Without a map there is only the figure's size.
    """
    points = 72 / figure.dpi
    told: dict[str, Any] = {"size": (figure.get_size_inches() * 72).round(2).tolist()}
    for name, axes in zip(("map", "evidence"), figure.axes, strict=False):
        if axes.has_data():
            box = axes.get_window_extent()
            parts = np.array([box.x0, figure.bbox.height - box.y1, box.width, box.height])
            told[name] = {
                "box": (parts * points).round(2).tolist(),
                "x": [float(end) for end in axes.get_xlim()],
                "y": [float(end) for end in axes.get_ylim()],
            }
    return told


def draw_survey(
    session: Session, title: str, track: Track, pins: Sequence[Pin], wave: tuple[float, float]
) -> Figure:
    """Draw a survey; the first axes are the map, and the second axes the evidence.

    The wave is its wavelength in mm, and the position of a crest in mm before the drive moved it.
    """
    told = session.about.get("metres")
    length_mm = 1000 * told if isinstance(told, int | float) else 0.0
    known = track.head_mm[track.known]
    if not known.size:
        return draw_note(f"{title}: the survey never knew where the capsule was")
    length_mm = max([length_mm, *known, *(place.place_mm for place in session.places)])
    places = list(zip(session.places, pins, strict=False))
    picture = _Picture(track, track.time_s / 60, places, length_mm, *wave)
    # Nodules before others, those with more evidence first; then in the order of their numbers.
    order = {status: rank for rank, status in enumerate(_PIN_LOOKS)}
    ranked = sorted(
        places, key=lambda each: (order[each[0].status], -np.nan_to_num(each[0].height))
    )
    shown = sorted(ranked[:_ACROSS], key=lambda each: each[0].place)
    heights_in = [_MAP_IN, _ROW_IN] if shown else [_MAP_IN]
    with style.new_figure(style.PAGE_WIDTH_IN, sum(heights_in) + 0.35) as figure:
        figure.suptitle(title, x=0.01, ha="left", fontsize=8.5)
        parts = figure.subfigures(len(heights_in), 1, squeeze=False, height_ratios=heights_in)[:, 0]
        space, evidence = parts[0].subplots(1, 2, sharey=True, width_ratios=[4.6, 1])
        _draw_map(space, picture)
        _draw_evidence(evidence, picture)
        for part in parts[1:]:
            panels = part.subplots(1, _ACROSS, squeeze=False)[0]
            for axes in panels[len(shown) :]:
                axes.set_visible(False)
            for axes, (place, pin) in zip(panels, shown, strict=False):
                _draw_place(axes, picture, place, pin)
            panels[0].set_ylabel("time (min)")
        style.add_legend(figure, [space, evidence], handlelength=2.4)
    return figure


def _draw_window(
    axes: Axes,
    picture: _Picture,
    within_mm: tuple[float, float],
    within_min: tuple[float, float],
) -> int:
    """Draw a part of the head's path, and some of the wave's crests as faint diagonals.

    Each piece of the path has the look of its group of states. Return n if every n-th crest is
    drawn, and 0 without one.
    """
    axes.set(xlim=within_mm, ylim=within_min[::-1])
    track, moments_min = picture.track, picture.time_min
    for (unmeasured, group), some in _pieces(track):
        time_min = moments_min[some]
        if time_min[-1] < within_min[0] or time_min[0] > within_min[1]:
            continue
        look: Look = {**_LOOKS[group], **(_UNMEASURED if unmeasured else {})}
        axes.plot(track.head_mm[some], time_min, solid_capstyle="round", zorder=3, **look)
    known = ~np.isnan(track.wave_mm)
    if not np.isfinite(picture.crest_mm) or np.count_nonzero(known) < 2:
        return 0
    # The wave moves evenly between judgements.
    time_min = np.linspace(*within_min, 200)
    wave_mm = np.interp(time_min, moments_min[known], track.wave_mm[known]) + picture.crest_mm
    # How many waves the panel's two sides are ahead of a crest: crests are at whole numbers.
    ahead = (np.array(within_mm) - wave_mm[:, np.newaxis]) / picture.wavelength_mm
    every = max(1, -(-int(np.ptp(ahead)) // _WAVES))
    crests = np.arange(np.ceil(ahead.min() / every), ahead.max() / every) * every
    look = {"colors": _WAVE, "linewidths": 0.5, "linestyles": "solid", "zorder": 1}
    axes.contour(within_mm, time_min, ahead, levels=crests, **look)
    return every


def _pieces(track: Track) -> list[tuple[tuple[bool, str], slice]]:
    """Return the pieces of one look: whether the position is unknown at an end, group and samples.

    The last judgement of a piece is also the first of the next. Measured pieces come first, as the
    legend shows the first line of each group.
    """
    unmeasured = ~(track.known[:-1] & track.known[1:])
    # The state after a judgement lasts until the next judgement.
    looks = list(zip(unmeasured.tolist(), map(group_of, track.state[:-1]), strict=True))
    pieces = []
    for look, same in groupby(range(len(looks)), key=looks.__getitem__):
        steps = list(same)
        pieces.append((look, slice(steps[0], steps[-1] + 2)))
    return sorted(pieces, key=lambda piece: piece[0][0])


def _draw_map(axes: Axes, picture: _Picture) -> None:
    """Draw the path of the whole survey, some waves, and a pin for each place."""
    length_mm, span_min = picture.length_mm, (0.0, float(picture.time_min[-1]))
    within_mm = (-0.02 * length_mm, 1.02 * length_mm)
    every = _draw_window(axes, picture, within_mm, span_min)
    axes.plot([], [], color=style.MUTED, label="position not measured", **_UNMEASURED)
    _draw_pins(axes, picture)
    if every:
        label = "crest of the wave" if every == 1 else f"crest of one wave in {every}"
        axes.plot([], [], color=_WAVE, linewidth=0.8, label=label)
    axes.set(xlabel="distance along the gut (mm)", ylabel="time (min)")
    axes.set_title("where the head was", color=style.MUTED)


def _draw_pins(axes: Axes, picture: _Picture) -> None:
    """Mark each place on the free side of the path, with its number and its size."""
    half_mm = picture.length_mm / 2
    # The area to the right is free above the path; the area to the left is free below it.
    for right in (True, False):
        some = [each for each in picture.places if (each[0].place_mm < half_mm) == right]
        middles = [(pin.suspected_s + pin.decided_s) / 120 for _, pin in some]
        span_min = float(picture.time_min[-1])
        labels = spread_out(middles, _LABEL_PT / _MAP_PT * span_min, span_min)
        reach_mm = (0.075 if right else -0.075) * picture.length_mm
        for (place, _), middle, label in zip(some, middles, labels, strict=True):
            word, look = str(OF_SURVEY[place.status]), _PIN_LOOKS[place.status]
            axes.plot([place.place_mm], [middle], zorder=4, label=word, **look)
            axes.annotate(
                f"{place.place} {place.verdict}",
                (place.place_mm, middle),
                (place.place_mm + reach_mm, label),
                arrowprops={"arrowstyle": "-", "color": style.MUTED, "linewidth": 0.5},
                ha="left" if right else "right",
                va="center",
                fontsize=7,
                bbox={"facecolor": "#ffffff", "edgecolor": "none", "pad": 0.6},
                zorder=5,
            )


def spread_out(places: Sequence[float], least: float, end: float) -> FloatArray:
    """Return ascending positions moved apart by at least `least`, and none beyond `end`.

    If there is not enough room, positions run together at the start.
    """
    steps = least * np.arange(len(places))
    apart = np.maximum.accumulate(places - steps) + steps
    moved: FloatArray = np.maximum(np.minimum(apart, end - steps[::-1]), 0.0)
    return moved


def _draw_evidence(axes: Axes, picture: _Picture) -> None:
    """Draw the score and the threshold of suspicion, on the map's axis of time."""
    time_min, score = picture.time_min, np.clip(picture.track.score, 0, None)
    # The highest score of each of so many pieces.
    pieces = np.array_split(np.arange(score.size), min(_POINTS_OF_EVIDENCE, score.size))
    known = np.nan_to_num(score, nan=-np.inf)
    some = [piece[known[piece].argmax()] for piece in pieces]
    look: Look = {"facecolor": style.GREY, "edgecolor": style.MUTED, "linewidth": 0.4}
    axes.fill_betweenx(time_min[some], 0, score[some], **look)
    level = np.clip(picture.track.threshold, 0, None)
    look = {"color": style.INK, "linewidth": 0.8, "linestyle": (0, (1, 1))}
    axes.plot(level, time_min, label="threshold of suspicion", **look)
    # Nodules' scores are many times the threshold. The square root keeps low scores visible.
    axes.set_xscale("function", functions=(np.sqrt, np.square))
    axes.xaxis.set_major_locator(MaxNLocator(3))
    axes.set(xlim=(0, 1.08 * np.nanmax([*score, *level])), xlabel="score")
    axes.set_title("evidence", color=style.MUTED)
    axes.tick_params(labelleft=False)


def _draw_place(axes: Axes, picture: _Picture, place: StoredPlace, pin: Pin) -> None:
    """Draw the path near a place, large enough to show its sawtooth."""
    time_min, at_mm = picture.time_min, place.place_mm
    within_min = (
        max(pin.suspected_s / 60 - _BEFORE_MIN, 0.0),
        min(pin.decided_s / 60 + _BEHIND_MIN, float(time_min[-1])),
    )
    # The whole path, up to a limit on both sides.
    inside = (time_min >= within_min[0]) & (time_min <= within_min[1])
    head_mm = np.clip(picture.track.head_mm[inside], at_mm - _FARTHEST_MM, at_mm + _FARTHEST_MM)
    reach_mm = [at_mm - _BEFORE_MM, at_mm + _BEHIND_MM, *(head_mm - _MARGIN_MM)]
    within_mm = (min(reach_mm), max([*reach_mm, *(head_mm + _MARGIN_MM)]))
    _draw_window(axes, picture, within_mm, within_min)
    axes.axvline(at_mm, color=style.MUTED, linewidth=0.6, zorder=2)
    axes.plot([at_mm], [within_min[0]], clip_on=False, zorder=4, **_PIN_LOOKS[place.status])
    axes.set_xlabel("distance (mm)")
    verdict = place.verdict.replace(", ", ",\n    ")
    axes.set_title(f"{place.place}  {verdict}", fontsize=7.5, pad=7)
