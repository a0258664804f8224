"""Simulate the lessons of the training: the beats of many random benches, padded to one length."""

import sys
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TypeVar

import numpy as np

from capsule.detectors.network import SENSORS
from capsule.detectors.search import SERIES, series_of
from capsule.detectors.wave import wave_of
from capsule.kinds import Settings
from capsule.phantom.parameters import Phantom, value_of, with_values
from capsule.phantom.simulation import simulate_run
from capsule.seeding import generator
from scorer_teaching.bench_family import draw_bench
from scorer_teaching.bench_recordings import simulate_bench

Item = TypeVar("Item")
# A function that simulates the recordings of one bench.
Maker = Callable[[], list[np.ndarray]]
# Sizes of the nodules in the recordings of every bench, in mm.
SIZES_MM = np.repeat(np.arange(6.0), (16, 12, 12, 8, 6, 6))
# One phantom with random parameters for so many random benches.
BENCHES_A_PHANTOM = 10
# A run of 990 samples gives at most 120 windows of beats.
LENGTH = 128
# Standard deviation of the logarithm of the factor on a phantom's parameters, by part. A factor of
# 2 would move the first ones out of the model's range, so they vary less.
_SPREADS = (
    (0.2, "contact", ("unit_stiffness_n_mm", "patch_mm2", "fold_limit_mm")),
    (0.2, "advance", ("speed_mm_s", "lead_mm")),
    (0.7, "wall", ("unevenness_mm", "unevenness_length_mm")),
    (0.7, "contact", ("reach_mm", "bearing_height_mm", "series_offset_mm", "height_offset_mm")),
    (0.7, "contact", ("coupling_spread", "wander_mm", "wander_time_s")),
    (0.7, "advance", ("speed_spread", "stroke_spread", "snag", "hold_waves", "lead_spread_mm")),
    (0.7, "sensor", ("gauge_per_mm", "saturation_mm", "lag_s", "creep_s", "settling")),
    (0.7, "sensor", ("settling_s", "drift_per_s", "noise")),
)
_SECONDS_BETWEEN = 20.0


@dataclass(frozen=True)
class Episodes:
    """The recordings of many benches.

    Attributes
    ----------
    series : (B, n, 4, 5, `LENGTH`) array of float16
        Beats from `capsule.detectors.search.series_of`; zeros after the end.
    counts : (B, n) array of int64
        Number of filled windows; 0 for a recording without beats.
    """

    series: np.ndarray
    counts: np.ndarray

    def recordings(self, bench: int) -> list[np.ndarray]:
        """Return the recordings of a bench that have beats, each (4, 5, N)."""
        rows = zip(self.series[bench], self.counts[bench].tolist(), strict=True)
        return [row[..., :count].astype(np.float64) for row, count in rows if count]


def episode(recordings: Sequence[np.ndarray], settings: Settings) -> tuple[np.ndarray, np.ndarray]:
    """Return the series and counts, as in `Episodes`, of one bench's recordings, each (4, K).

    The configuration tells rate and wave of the bench.
    """
    rate_hz, bench = settings["recording"]["rate_hz"], settings["diagonal"]
    series = np.zeros((len(recordings), SENSORS, len(SERIES), LENGTH), np.float16)
    counts = np.zeros(len(recordings), np.int64)
    for place, counted in enumerate(recordings):
        beats = series_of(wave_of(counted.astype(float), rate_hz, bench))
        if beats is not None:
            counts[place] = min(beats.shape[-1], LENGTH)
            series[place, ..., : counts[place]] = beats[..., :LENGTH]
    return series, counts


def random_recordings(seed: int, name: str) -> list[np.ndarray]:
    """Return simulated recordings of a random bench; seed and name determine the bench."""
    streams = partial(generator, seed, "bench", name)
    return simulate_bench(draw_bench(streams("bench")), SIZES_MM, streams)


def draw_phantom(base: Phantom, numbers: np.random.Generator) -> Phantom:
    """Return a random phantom: many parameters are multiplied by a random factor."""
    spreads = {f"{part}.{key}": spread for spread, part, keys in _SPREADS for key in keys}
    values = {
        name: value_of(base, name) * float(np.exp(numbers.normal(0, spread)))
        for name, spread in spreads.items()
    }
    return with_values(base, values)


def phantom_recordings(base: Phantom, seed: int, name: str) -> list[np.ndarray]:
    """Return simulated recordings of a random phantom; seed and name determine the phantom."""
    numbers = generator(seed, "random phantom", name, "parameters")
    phantom = draw_phantom(base, numbers)
    runs_seed = int(numbers.integers(1 << 31))
    return [
        simulate_run(phantom, size, runs_seed, f"{size:g}mm/r{number:02d}").counts
        for number, size in enumerate(SIZES_MM.tolist())
    ]


def random_benches(seed: int, first: int, count: int, base: Phantom | None) -> list[Maker]:
    """Return functions that simulate random benches, and random phantoms after them.

    Parameters
    ----------
    seed : int
        Random seed.
    first, count : int
        Number of the first random bench, and how many there are.
    base : Phantom or None
        The phantom whose parameters vary; None for no phantoms.
    """
    beyond = first + count
    makers: list[Maker] = [partial(random_recordings, seed, f"{n}") for n in range(first, beyond)]
    if base is not None:
        phantoms = range(first // BENCHES_A_PHANTOM, beyond // BENCHES_A_PHANTOM)
        makers += [partial(phantom_recordings, base, seed, f"{n}") for n in phantoms]
    return makers


def held_out_benches(seed: int, count: int) -> list[Maker]:
    """Return functions that simulate random benches that teach nothing."""
    return [partial(random_recordings, seed, f"held out {n}") for n in range(count)]


def episodes_of(makers: Sequence[Maker], settings: Settings) -> Episodes:
    """Return the episodes of many benches, simulated by the given functions; see `episode`."""
    series = np.zeros((len(makers), SIZES_MM.size, SENSORS, len(SERIES), LENGTH), np.float16)
    counts = np.zeros((len(makers), SIZES_MM.size), np.int64)
    for place, make in enumerate(progress(makers, "bench")):
        series[place], counts[place] = episode(make(), settings)
    return Episodes(series, counts)


def progress(
    work: Sequence[Item], name: str, clock: Callable[[], float] = time.monotonic
) -> Iterator[Item]:
    """Yield pieces of work; print at most every 20 s how many are done and the time left.

    Parameters
    ----------
    work, name
        The pieces, and what the lines call one.
    clock
        Function that returns the time in seconds.
    """
    begin = last = clock()
    for done, piece in enumerate(work, start=1):
        yield piece
        now = clock()
        if now - last >= _SECONDS_BETWEEN:
            last = now
            left_min = (now - begin) * (len(work) - done) / done / 60
            line = f"{name} {done} of {len(work)}, about {left_min:.1f} min left"
            print(line, file=sys.stderr, flush=True)
