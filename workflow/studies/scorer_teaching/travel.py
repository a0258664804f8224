"""Compute the phase of the wave and the motion of the capsule in each run of a random bench."""

from dataclasses import dataclass

import numpy as np

from scorer_teaching.bench_family import RandomBench, WaveTrain, Way
from scorer_teaching.random_numbers import Streams, smooth_noise

SENSORS = 4
LONGEST = 990
# Places along the gut, in pitches, for which `_spent` is computed.
_FINE = np.linspace(0, 60, 2400)
# Only a nodule higher than this holds a sensor.
_HOLDS_FROM = 0.3


@dataclass(frozen=True)
class Nodules:
    """The nodules of a bench's runs, from its `Lump`.

    Attributes
    ----------
    height : (n,) array
        Height in amplitudes of the wave.
    touch : (n, S) array
        Factor on the height at each sensor.
    width : (n,) array
        Width of the profile, in pitches.
    lead : (n,) array
        Distance of the first sensor from the nodule at the start, in pitches.
    """

    height: np.ndarray
    touch: np.ndarray
    width: np.ndarray
    lead: np.ndarray


def draw_nodules(bench: RandomBench, sizes_mm: np.ndarray, streams: Streams) -> Nodules:
    """Return random nodules of the given sizes (n,); size 0 has a place, but no height."""
    lump, way, count = bench.lump, bench.way, len(sizes_mm)
    known = {size: streams.of(f"size {size:g}").normal() for size in sorted(set(sizes_mm.tolist()))}
    alike = np.array([known[size] for size in sizes_mm.tolist()])
    own = streams.of("off").standard_normal(count)
    off_mm = lump.miss_mm * (np.sqrt(lump.miss_alike) * alike + np.sqrt(1 - lump.miss_alike) * own)
    met = np.exp(-0.5 * (off_mm / (0.5 * sizes_mm + 0.5 * lump.strip_mm)) ** 2)
    numbers = streams.of("touch")
    touch = np.exp(lump.touch_spread * numbers.standard_normal((count, SENSORS)))
    touch *= numbers.random((count, SENSORS)) >= lump.untouched_share
    lead = way.lead + way.lead_spread * streams.of("lead").standard_normal(count)
    return Nodules(
        height=lump.height * (sizes_mm / 3) ** lump.growth * met,
        touch=touch,
        width=lump.width + lump.width_a_mm * sizes_mm,
        lead=np.maximum(lead, 0.05),
    )


def wave_phase_of(wave: WaveTrain, runs: int, streams: Streams) -> np.ndarray:
    """Return a random phase of the wave at the start of the gut, (n, K), in radians."""
    numbers = streams.of("phase")
    begin = numbers.uniform(0, 2 * np.pi, (runs, 1))
    jitter = wave.period_jitter * smooth_noise(numbers, (runs,), LONGEST, 80, 0)
    return begin + np.cumsum(2 * np.pi / wave.period * (1 + jitter), axis=1)


def wave_number(phase: np.ndarray) -> np.ndarray:
    """Return the number of the wave at each sample (n, K), from 0."""
    number = np.floor(phase / (2 * np.pi)).astype(int)
    return number - number[:, :1]


def head_way(
    bench: RandomBench, nodules: Nodules, phase: np.ndarray, streams: Streams
) -> np.ndarray:
    """Return the place of the first sensor at each sample, (n, K), in pitches.

    Parameters
    ----------
    bench : RandomBench
        The bench, with the parameters of its wave and of the motion.
    nodules : Nodules
        The nodules, which slow the capsule.
    phase : (n, K) array
        Phase from `wave_phase_of`.
    streams : Streams
        Random numbers.

    Returns
    -------
    (n, K) array
    """
    way, runs = bench.way, len(phase)
    numbers = streams.of("pace")
    pace = np.exp(way.run_spread * numbers.standard_normal((runs, 1))) / way.lag
    free = _free_way(way, bench.wave.period, phase, streams.of("strokes")) * pace
    numbers = streams.of("holds")
    held = (numbers.random((runs, SENSORS)) < 0.5) * numbers.uniform(0, 2, (runs, SENSORS))
    held = held * way.hold * pace
    head = np.stack(
        [np.interp(free[run], _spent(way, nodules, held[run], run), _FINE) for run in range(runs)]
    )
    return head - way.slip_back * pace * bench.wave.period * (phase / (2 * np.pi) % 1)


def _free_way(
    way: Way, period: float, phase: np.ndarray, numbers: np.random.Generator
) -> np.ndarray:
    """Return a random motion (n, K) without a nodule, at a mean pace of 1 for each sample."""
    runs, count = phase.shape
    if not way.by_wave:
        pace = np.exp(way.stroke_spread * smooth_noise(numbers, (runs,), count, way.stroke_time, 1))
        return np.cumsum(pace, axis=1)
    number = wave_number(phase)
    waves = int(number.max()) + 1
    stroke = np.exp(way.stroke_spread * numbers.standard_normal((runs, waves)))
    stroke *= numbers.random((runs, waves)) >= way.stick
    part = np.clip(phase / (2 * np.pi) % 1 / way.grip, 0, 1)
    part = part**2 * (3 - 2 * part)
    before = np.cumsum(stroke, axis=1) - stroke
    strokes = np.take_along_axis(before, number, 1) + part * np.take_along_axis(stroke, number, 1)
    return (strokes - strokes[:, :1]) * period


def _spent(way: Way, nodules: Nodules, held: np.ndarray, run: int) -> np.ndarray:
    """Return for each place of `_FINE` the way of a capsule without a nodule in the same time."""
    height, width, lead = nodules.height[run], nodules.width[run], nodules.lead[run]
    if height == 0:
        return _FINE
    off = ((_FINE - lead)[:, np.newaxis] - np.arange(SENSORS)) / width
    climb = (-off * np.exp(-(off**2) / 2)).sum(axis=1)
    cost = np.exp(way.snag * min(height, 2.0) * climb)
    spent = np.concatenate([[0.0], np.cumsum(cost[1:] * np.diff(_FINE))])
    if height > _HOLDS_FROM:
        foot = lead + np.arange(SENSORS) - width
        passed = np.clip((_FINE[:, np.newaxis] - foot) / 0.02, -50, 50)
        spent = spent + (held / (1 + np.exp(-passed))).sum(axis=1)
    return spent
