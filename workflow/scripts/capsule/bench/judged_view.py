"""The display of a judged file in the terminal: sensors, places, and table of verdicts."""

from collections.abc import Mapping, Sequence
from itertools import pairwise

import numpy as np

from capsule import words
from capsule.bench.judged_file import JudgedFile
from capsule.bench.terminal import BARS, PLAIN_BARS, trace
from capsule.bench.verdict_table import verdict_table
from capsule.detectors.base import Verdict
from capsule.kinds import Settings
from capsule.recording import source_of

_MARKS = "abcdefghij"


def judged_lines(
    judged: JudgedFile, settings: Settings, width: int, *, plain: bool = False
) -> list[str]:
    """Return the lines that show a judged file.

    Parameters
    ----------
    judged : JudgedFile
        The file's result.
    settings : mapping
        Sections ``recording`` and ``evaluation`` of the configuration.
    width : int
        Largest number of characters in a line of the plot.
    plain : bool
        Whether the terminal shows ASCII only.
    """
    check = judged.check
    if not judged.is_accepted:
        return [f"{judged.file}: rejected: {check['reason']}"]
    rate_hz = settings["recording"]["rate_hz"]
    source = source_of(check["header"]) or "source not given"
    duration = words.duration(check["duration_s"])
    title = f"{judged.file}: {check['samples']} samples, {duration}, {source}"
    places = places_s(judged.verdicts, rate_hz)
    lines = [title, *_plot(judged.values, places, rate_hz, width, plain=plain)]
    if check["no_verdict"]:
        return [*lines, f"no detector can judge it: {check['no_verdict']}"]
    lines += verdict_table(judged.verdicts, settings, judged.familiarity)
    prevalence = words.percent(settings["evaluation"]["prevalence"])
    lines.append(
        "place: time and distance at which sensor 1 passes the nodule; probability: of a nodule, "
        f"if {prevalence} of all recordings have one"
    )
    if judged.taught_as:
        lines.append(
            f"note: the detectors have learned from this very recording ({judged.taught_as}), so "
            "they already know its size"
        )
    return lines


def places_s(verdicts: Mapping[str, Verdict], rate_hz: float) -> dict[float, list[str]]:
    """Return the times in s at which sensor 1 passes a nodule, each with its detectors' names."""
    places: dict[float, list[str]] = {}
    for name, verdict in verdicts.items():
        if words.is_known(verdict.location_samples):
            places.setdefault(verdict.location_samples / rate_hz, []).append(name)
    return dict(sorted(places.items()))


def _plot(
    values: np.ndarray,
    places: Mapping[float, Sequence[str]],
    rate_hz: float,
    width: int,
    *,
    plain: bool,
) -> list[str]:
    """Return one line of bars per sensor, and below them a mark at each place."""
    label = "sensor 1 "
    cells = max(min(width - len(label), values.shape[1]), 1)
    edges = np.linspace(0, values.shape[1], cells + 1).astype(int)
    bars = PLAIN_BARS if plain else BARS
    lines = []
    for sensor, readings in enumerate(values, start=1):
        means = [_mean(readings[a:b]) for a, b in pairwise(edges)]
        lines.append(f"{f'sensor {sensor}':<{len(label)}}{trace(means, bars)}".rstrip())
    inside = {place: names for place, names in places.items() if place >= 0}
    if inside:
        row = [" "] * cells
        for mark, place in zip(_MARKS, inside, strict=False):
            row[min(int(place * rate_hz * cells / values.shape[1]), cells - 1)] = mark
        lines.append(f"{'place':<{len(label)}}{''.join(row)}".rstrip())
        named = [
            f"{mark}: {words.enumerate_words(names)}"
            for mark, names in zip(_MARKS, inside.values(), strict=False)
        ]
        lines.append(f"{'':<{len(label)}}{', '.join(named)}")
    return lines


def _mean(readings: np.ndarray) -> float | None:
    known = readings[~np.isnan(readings)]
    return float(known.mean()) if known.size else None
