"""Draw the space-time picture of a survey: distance to the right, time downward.

The capsule's path runs from the upper left to the lower right. It has a sawtooth where the capsule
went back and looked again. The evidence is beside the map; enlarged suspected places are below it.
"""

import textwrap
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator

from capsule import words
from capsule.arrays import FloatArray, IntArray
from capsule.detectors.verdicts import OF_SURVEY
from capsule.figures.style import (
    BLUE,
    GREY,
    INK,
    MUTED,
    ORANGE,
    PAGE_WIDTH_IN,
    new_figure,
    say_nothing_to_show,
)
from capsule.kinds import Look
from capsule.survey.files import Session, StoredPlace
from capsule.survey.track import AGAIN, AHEAD, BACK, Pin, Track, runs_of, simplified

# The suspected places, and the interval in which the survey examined each.
_Places = Sequence[tuple[StoredPlace, Pin]]

# One look per group of states; the path is dashed where the position was not measured.
_LOOKS: dict[str, Look] = {
    AHEAD: {"color": BLUE, "linewidth": 1.1, "label": "travels ahead"},
    BACK: {"color": ORANGE, "linewidth": 1.1, "label": "folds, is pushed back, unfolds"},
    AGAIN: {"color": INK, "linewidth": 1.9, "label": "finds its position, passes again"},
}
_THRESHOLD: Look = {"color": INK, "linewidth": 0.8, "linestyle": (0, (1, 1))}
_UNMEASURED = (0, (2.2, 1.4))
_PIN = {"color": INK, "markersize": 5, "markeredgewidth": 0.9, "linestyle": "none"}
_PIN_LOOKS: dict[str, Look] = {
    "confirmed": {**_PIN, "marker": "o", "markerfacecolor": INK},
    "dismissed": {**_PIN, "marker": "o", "markerfacecolor": "#ffffff"},
    "undecided": {**_PIN, "marker": "D", "markerfacecolor": "#ffffff"},
}
_WAVE = "#b9c2cc"
# With more waves, the lines merge into a grey area.
_WAVES = 24
# The distance and time that a place's panel shows around the place.
_BEFORE_MM, _BEHIND_MM, _BEFORE_S, _BEHIND_S = 22.0, 30.0, 25.0, 20.0
_MARGIN_MM, _FARTHEST_MM = 3.0, 90.0
_POINTS_ACROSS, _PATH_MM = 1500, 0.3
_POINTS_OF_EVIDENCE = 300
# Of the picture: places side by side, and the heights of the map and of the row of places.
_ACROSS, _MAP_IN, _ROW_IN = 4, 4.0, 2.15
# A gap between two pieces of one line.
_BREAK = np.full((1, 2), np.nan)
# Least distance between the map's labels, and approximate height of the map, in points.
_LABEL_PT, _MAP_PT = 9.5, 220


@dataclass(frozen=True)
class _Picture:
    """What the panels of a survey's picture show; `length_mm` is the length of the distance."""

    track: Track
    places: _Places
    length_mm: float
    # Length of the wave, and a crest before the drive moved it; NaN if no wave was felt.
    wavelength_mm: float
    crest_mm: float


def track_table(track: Track) -> pd.DataFrame:
    """Return the data of a survey's picture, with a row per judgement."""
    return pd.DataFrame(
        {
            "time_s": track.time_s,
            "head_mm": np.round(track.head_mm, 2),
            "measured": track.known,
            "state": track.state,
            "score": track.score,
            "threshold": track.threshold,
            "wave_mm": track.wave_mm,
        }
    )


def draw_unreadable(name: str, problem: str) -> Figure:
    """Draw that a survey cannot be read, with the reason."""
    with new_figure(PAGE_WIDTH_IN, 1.0) as figure:
        text = textwrap.fill(f"{name} cannot be read: {problem}", 100)
        say_nothing_to_show(figure.subplots(), text)
    return figure


def frame_of(figure: Figure) -> dict[str, Any]:
    """Return the positions of map and evidence in a rendered figure.

    A box is left, top, width, height, in points from the upper left; x and y are the limits of the
    axes. Without a map there is only the figure's size.
    """
    width, height = figure.get_size_inches() * 72
    told: dict[str, Any] = {"size": np.round([width, height], 2).tolist()}
    for name, axes in zip(("map", "evidence"), figure.axes, strict=False):
        if not axes.xaxis.get_visible() or not len(axes.get_xticks()):
            continue
        box = axes.get_window_extent().transformed(figure.transFigure.inverted())
        parts = np.array([box.x0, 1 - box.y1, box.width, box.height]) * np.tile([width, height], 2)
        told[name] = {
            "box": parts.round(2).tolist(),
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
    length_mm = max([length_mm, *known, *(place.place_mm for place in session.places)])
    pairs = list(zip(session.places, pins, strict=False))
    picture = _Picture(track, pairs, length_mm, *wave)
    shown = _places_shown(pairs)
    heights_in = [_MAP_IN, _ROW_IN] if shown else [_MAP_IN]
    with new_figure(PAGE_WIDTH_IN, sum(heights_in) + 0.35) as figure:
        figure.suptitle(title, x=0.01, ha="left", fontsize=8.5)
        parts = figure.subfigures(len(heights_in), 1, squeeze=False, height_ratios=heights_in)[:, 0]
        space, evidence = parts[0].subplots(1, 2, sharey=True, width_ratios=[4.6, 1])
        if not known.size:
            say_nothing_to_show(space, "the survey never knew where the capsule was")
            say_nothing_to_show(evidence, "")
            return figure
        _draw_map(space, picture)
        _draw_evidence(evidence, track)
        for part in parts[1:]:
            panels = part.subplots(1, _ACROSS, squeeze=False)[0]
            for axes in panels[len(shown) :]:
                axes.set_visible(False)
            for axes, (place, pin) in zip(panels, shown, strict=False):
                _draw_place(axes, picture, place, pin)
            panels[0].set_ylabel("time (s)")
        _add_legend(figure, pairs)
    return figure


def _places_shown(places: _Places) -> _Places:
    """Return the places that have room, nodules before others, in the order of their numbers."""
    order = ("confirmed", "undecided", "dismissed")
    ranked = sorted(
        places, key=lambda pair: (order.index(pair[0].status), -np.nan_to_num(pair[0].height))
    )
    return sorted(ranked[:_ACROSS], key=lambda pair: pair[0].place)


def _add_legend(figure: Figure, places: _Places) -> None:
    handles = [Line2D([], [], **look) for look in _LOOKS.values()]
    handles += [
        Line2D([], [], label="position not measured", color=MUTED, linestyle=_UNMEASURED),
        Line2D([], [], label="threshold of suspicion", **_THRESHOLD),
    ]
    handles += [
        line for line in figure.axes[0].get_lines() if str(line.get_label()).startswith("crest")
    ]
    present = {place.status for place, _ in places}
    handles += [
        Line2D([], [], label=status, **look)
        for status, look in _PIN_LOOKS.items()
        if status in present
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=4, handlelength=2.4)


def _draw_path(
    axes: Axes, track: Track, within_s: tuple[float, float], per_s: float, tolerance_mm: float
) -> None:
    """Draw the head's path; each piece has the look of its group of states."""
    lines: dict[tuple[str, bool], list[FloatArray]] = {}
    for run in runs_of(track):
        some = slice(run.first, run.last + 1)
        time_s, head_mm = track.time_s[some], track.head_mm[some]
        if time_s[-1] < within_s[0] or time_s[0] > within_s[1]:
            continue
        enough = simplified(time_s, head_mm, tolerance_mm)
        points = np.column_stack([head_mm[enough], time_s[enough] / per_s])
        lines.setdefault((run.group, run.known), []).extend([points, _BREAK])
    for (group, known), pieces in lines.items():
        axes.plot(
            *np.concatenate(pieces).T,
            linestyle="-" if known else _UNMEASURED,
            solid_capstyle="round",
            dash_capstyle="butt",
            zorder=3,
            **_LOOKS[group],
        )


def _draw_waves(
    axes: Axes,
    picture: _Picture,
    within_mm: tuple[float, float],
    within_s: tuple[float, float],
    per_s: float,
) -> int:
    """Draw the wave's crests as faint diagonals; return n if every n-th crest is drawn, or 0."""
    track, wavelength_mm = picture.track, picture.wavelength_mm
    known = ~np.isnan(track.wave_mm)
    if not np.isfinite(picture.crest_mm) or np.count_nonzero(known) < 2:
        return 0
    # The wave moves evenly between judgements. A fine grid lets its lines reach the panel's edges.
    time_s = np.linspace(within_s[0], within_s[1], 2000)
    wave_mm = np.interp(time_s, track.time_s[known], track.wave_mm[known]) + picture.crest_mm
    numbers = np.arange(
        np.floor((within_mm[0] - wave_mm.max()) / wavelength_mm),
        np.ceil((within_mm[1] - wave_mm.min()) / wavelength_mm) + 1,
    )
    every = max(1, -(-numbers.size // _WAVES))
    drawn: list[tuple[float, float]] = []
    for number in numbers[numbers % every == 0]:
        at_mm = wave_mm + number * wavelength_mm
        inside = np.flatnonzero((at_mm >= within_mm[0]) & (at_mm <= within_mm[1]))
        if inside.size > 1:
            drawn += [(at_mm[end], time_s[end] / per_s) for end in inside[[0, -1]]]
            drawn.append((np.nan, np.nan))
    if drawn:
        axes.plot(*np.array(drawn).T, color=_WAVE, linewidth=0.5, zorder=1)
    return every


def _draw_map(axes: Axes, picture: _Picture) -> None:
    """Draw the path of the whole survey, some waves, and a pin for each place."""
    track = picture.track
    span_s = (0.0, float(track.time_s[-1]))
    margin_mm = 0.02 * picture.length_mm
    within_mm = (-margin_mm, picture.length_mm + margin_mm)
    every = _draw_waves(axes, picture, (0.0, picture.length_mm), span_s, 60.0)
    _draw_path(axes, track, span_s, 60.0, picture.length_mm / _POINTS_ACROSS)
    _draw_pins(axes, picture)
    axes.set(xlim=within_mm, ylim=(span_s[1] / 60, 0), xlabel="distance along the gut (mm)")
    axes.set_ylabel("time (min)")
    axes.set_title("where the head was", color=MUTED)
    if every:
        label = "crest of the wave" if every == 1 else f"crest of one wave in {every}"
        axes.plot([], [], color=_WAVE, linewidth=0.8, label=label)


def _draw_pins(axes: Axes, picture: _Picture) -> None:
    """Mark each place on the free side of the path, with its number and its size."""
    # The area to the right is free above the path; the area to the left is free below it.
    for right in (True, False):
        some = [
            each for each in picture.places if (each[0].place_mm < picture.length_mm / 2) == right
        ]
        middles = [(pin.suspected_s + pin.decided_s) / 120 for _, pin in some]
        span = float(picture.track.time_s[-1]) / 60
        labels = spread_out(middles, _LABEL_PT / _MAP_PT * span, span)
        reach_mm = (0.075 if right else -0.075) * picture.length_mm
        for (place, _), middle, label in zip(some, middles, labels, strict=True):
            at_mm = place.place_mm + reach_mm
            axes.plot(
                [place.place_mm, at_mm], [middle, label], color=MUTED, linewidth=0.5, zorder=2
            )
            axes.plot([at_mm], [label], zorder=4, **_PIN_LOOKS[place.status])
            axes.annotate(
                f"{place.place} {verdict_words(place)}",
                (at_mm, label),
                xytext=(5 if right else -5, 0),
                textcoords="offset points",
                ha="left" if right else "right",
                va="center",
                fontsize=7,
                bbox={"facecolor": "#ffffff", "edgecolor": "none", "pad": 0.6},
                zorder=5,
            )


def spread_out(places: Sequence[float], least: float, end: float) -> list[float]:
    """Return ascending positions moved apart by at least `least`, and none beyond `end`.

    If there is not enough room, positions run together at the start.
    """
    moved: list[float] = []
    for place in places:
        moved.append(max(place, moved[-1] + least) if moved else place)
    limit = end
    for number in range(len(moved) - 1, -1, -1):
        moved[number] = max(min(moved[number], limit), 0.0)
        limit = moved[number] - least
    return moved


def verdict_words(place: StoredPlace) -> str:
    """Return the verdict on a place with its size: ``nodule, 3.1 mm (2.4 to 3.8)``."""
    word = str(OF_SURVEY[place.status])
    if place.status != "confirmed" or not words.is_known(place.size_mm):
        return word
    return f"{word}, {place.size}"


def _draw_evidence(axes: Axes, track: Track) -> None:
    """Draw the score and the threshold of suspicion, on the map's axis of time."""
    some = _highest_of_each(track.score, _POINTS_OF_EVIDENCE)
    minutes = track.time_s[some] / 60
    score, level = (np.clip(values, 0, None) for values in (track.score[some], track.threshold))
    axes.fill_betweenx(minutes, 0, score, facecolor=GREY, edgecolor=MUTED, linewidth=0.4)
    enough = simplified(track.time_s, level, 0.02 * float(level.max()))
    axes.plot(level[enough], track.time_s[enough] / 60, **_THRESHOLD)
    # Nodules' scores are many times the threshold. The square root keeps low scores visible.
    axes.set_xscale("function", functions=(np.sqrt, np.square))
    top = 1.08 * max(float(np.nanmax(score, initial=0.0)), float(level.max()))
    axes.set(xlim=(0, top), xlabel="score", xticks=_round_ticks(top))
    axes.set_title("evidence", color=MUTED)
    axes.tick_params(labelleft=False)


def _round_ticks(top: float) -> list[float]:
    """Return the ticks of a square-root scale: 0, one near the middle, and one near the end."""
    steps = [digit * 10.0**power for power in range(-4, 3) for digit in (1, 2, 5)]
    return [0, *(max(step for step in steps if step <= share * top) for share in (0.25, 1.0))]


def _highest_of_each(values: FloatArray, most: int) -> IntArray:
    """Return the indices of the highest values of at most `most` pieces of a long series."""
    pieces = np.array_split(np.arange(values.size), min(most, values.size))
    known = np.nan_to_num(values, nan=-np.inf)
    return np.array([piece[known[piece].argmax()] for piece in pieces])


def _around(track: Track, place_mm: float, within_s: tuple[float, float]) -> tuple[float, float]:
    """Return the range in mm of a place's panel: its whole path, up to a limit on both sides."""
    inside = (track.time_s >= within_s[0]) & (track.time_s <= within_s[1])
    head_mm = np.clip(track.head_mm[inside], place_mm - _FARTHEST_MM, place_mm + _FARTHEST_MM)
    low, high = place_mm - _BEFORE_MM, place_mm + _BEHIND_MM
    return min(low, *(head_mm - _MARGIN_MM)), max(high, *(head_mm + _MARGIN_MM))


def _draw_place(axes: Axes, picture: _Picture, place: StoredPlace, pin: Pin) -> None:
    """Draw the path near a place, large enough to show its sawtooth."""
    within_s = (
        max(pin.suspected_s - _BEFORE_S, 0.0),
        min(pin.decided_s + _BEHIND_S, float(picture.track.time_s[-1])),
    )
    within_mm = _around(picture.track, place.place_mm, within_s)
    _draw_waves(axes, picture, within_mm, within_s, 1.0)
    axes.axvline(place.place_mm, color=MUTED, linewidth=0.6, zorder=2)
    _draw_path(axes, picture.track, within_s, 1.0, _PATH_MM)
    axes.plot([place.place_mm], [within_s[0]], clip_on=False, zorder=4, **_PIN_LOOKS[place.status])
    axes.set(xlim=within_mm, ylim=(within_s[1], within_s[0]), xlabel="distance (mm)")
    axes.xaxis.set_major_locator(MaxNLocator(3, integer=True))
    axes.yaxis.set_major_locator(MaxNLocator(5, integer=True))
    verdict = verdict_words(place).replace(", ", ",\n    ")
    axes.set_title(f"{place.place}  {verdict}", fontsize=7.5, pad=7)
