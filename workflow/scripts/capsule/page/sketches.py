"""The small drawings of the first screen, as points of SVG paths for the templates.

The templates draw them with the page's colours; no drawing needs a script.
"""

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from capsule import words
from capsule.evaluation.answers import Estimate
from capsule.kinds import Cells, Row
from capsule.page.packing import unpack

# In units of the drawings: where the drawn area begins and ends, and the height of a sensor's row.
LEFT, RIGHT, ROW = 40.0, 510.0, 32.0
# Room above the first row, for its highest bump.
_TOP = 10.0
_STEPS_S = (1, 2, 5, 10, 20, 50, 100, 200, 500, 1000)
# The least range of depth, in usual depths, so that small noise does not look like bumps.
_LEAST_RANGE = 0.6
# Of the strip: tops of its two rows of marks and the height of a mark.
_MARKS, _MARK = (6.0, 24.0), 13.0


def felt_sketch(drawn: Row, *, diagonal: bool) -> Cells:
    """Return the drawing of what each sensor felt, with the diagonal if all sensors passed it.

    `drawn` is what `capsule.page.plot_data` draws of a recording. The rows are the depths of its
    beats in usual depths, or without beats the envelopes in SD.
    """
    beats = drawn["beats"]
    felt = unpack(beats or drawn["envelope"])
    if beats:
        first_s, step_s, passed_s = (beats[name] for name in ("first_s", "step_s", "passed_s"))
    else:
        first_s, step_s = 0.0, drawn["envelope"]["every"] * drawn["interval_s"]
        passed_s = [None] * len(felt)
    time_s = first_s + step_s * np.arange(felt.shape[1])
    base = 1.0 if beats else float(np.nanmin(felt))
    most = max(float(np.nanmax(felt)) - base, _LEAST_RANGE)
    last_s = float(time_s[-1]) or 1.0
    across = _scale(0.0, last_s, LEFT, RIGHT)

    def down(sensor: int, value: float) -> float:
        return round(_TOP + ROW * (sensor + 0.95) - 0.85 * ROW * (value - base) / most, 1)

    rows, passed = [], []
    for sensor, (values, at) in enumerate(zip(felt, passed_s, strict=True)):
        known = ~np.isnan(values)
        known_s, values = time_s[known], values[known]
        points = [
            f"{across(when)} {down(sensor, value)}"
            for when, value in zip(known_s, values, strict=True)
        ]
        line, low = "M" + "L".join(points), down(sensor, base)
        area = f"{line}L{across(known_s[-1])} {low}L{across(known_s[0])} {low}Z"
        rows.append({"base": low, "line": line, "area": area, "deepest": float(values.max())})
        if at is not None and 0 <= at <= last_s:
            passed.append((across(at), down(sensor, float(np.interp(at, known_s, values)))))
    step = next((each for each in _STEPS_S if last_s / each <= 7), _STEPS_S[-1])
    return {
        "width": RIGHT + 50,
        "height": _TOP + ROW * len(felt) + 18,
        "rows": rows,
        "in_depths": beats is not None,
        "ticks": [(across(at), at) for at in range(0, int(last_s) + 1, step)],
        "passed": passed if diagonal and len(passed) == len(felt) else [],
    }


def score_strip(
    healthy: Sequence[float], nodules: Sequence[float], threshold: float, score: float
) -> Cells:
    """Return the strip of scores: a row of marks of the healthy, one of the nodules that teach.

    Of the healthy, so many are ``above`` the threshold, and ``higher`` than this score or equal.
    """
    every = [*healthy, *nodules, threshold, score]
    across = _scale(min(every), max(every), LEFT + 84, RIGHT)
    return {
        "width": RIGHT + 50,
        "height": _MARKS[1] + _MARK + 21,
        "marks": [
            "".join(f"M{across(value)} {top}v{_MARK}" for value in some)
            for top, some in zip(_MARKS, (healthy, nodules), strict=True)
        ],
        "threshold": across(threshold),
        "this": across(score),
        "of": (len(healthy), len(nodules)),
        "above": sum(each > threshold for each in healthy),
        "higher": sum(each >= score for each in healthy),
    }


def size_chart(series: Mapping[str, Mapping[float, Estimate]], sizes_mm: Sequence[float]) -> Cells:
    """Return the chart of the share of nodules found by size in mm, of each series by its name."""
    width, height, left, top = 360.0, 170.0, 44.0, 12.0
    step = (width - left) / max(len(sizes_mm), 1)
    middles = {size: left + step * (place + 0.5) for place, size in enumerate(sizes_mm)}
    down = _scale(1.0, 0.0, top, height)
    drawn = []
    for number, (name, found) in enumerate(series.items()):
        off = 11.0 * (number - (len(series) - 1) / 2)
        points = [
            (round(middle + off, 1), *map(down, (rate.value, rate.low, rate.high)))
            for size, middle in middles.items()
            if (rate := found.get(size)) and words.is_known(rate.low)
        ]
        texts = [found[size].text() if size in found else words.NOT_GIVEN for size in sizes_mm]
        drawn.append({"name": name, "points": points, "texts": texts})
    return {
        "width": width,
        "height": height + 20,
        "left": left,
        "grid": [(down(share / 100), share) for share in (100, 50, 0)],
        "sizes": [(round(middle, 1), words.size(size)) for size, middle in middles.items()],
        "series": drawn,
    }


def _scale(low: float, high: float, start: float, end: float) -> Callable[[float], float]:
    """Return what places the values from low to high in a drawing, between its start and end."""
    span = (high - low) or 1.0
    return lambda value: round(float(start + (end - start) * (value - low) / span), 1)
