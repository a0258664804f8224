"""Simulate the recordings of a random bench: from wave, way, wall and nodule to counts."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter

from capsule.detectors.network import SENSORS
from scorer_teaching.bench_family import RandomBench, Wander, WaveTrain, Way

_LONGEST = 990
_SHORTEST = 250
_FULL_SCALE = 1024
# At half of the scale, a relative change x of the resistance changes a reading by 256 x counts.
_COUNTS_A_SHARE = 256
_BEHIND = np.arange(SENSORS)[:, np.newaxis]
# Number of cosines in the model of an uneven wall.
_COSINES = 12
# Places along the gut, in pitches, for which `_spent` is computed.
_FINE = np.linspace(0, 60, 2400)
# Only a nodule higher than this holds a sensor.
_HOLDS_FROM = 0.3

# A function that returns a subject's random stream from its beginning, so that the subjects do not
# affect one another.
Streams = Callable[[str], np.random.Generator]


def smooth_noise(
    numbers: np.random.Generator, shape: tuple[int, ...], count: int, time: float, kind: int
) -> np.ndarray:
    """Return random courses of unit variance.

    Parameters
    ----------
    numbers : numpy.random.Generator
        Random numbers.
    shape : tuple of int
        Numbers of courses along each axis.
    count : int
        Number of samples of each course.
    time : float
        Time within which a course changes, in samples.
    kind : int
        0: smooth (Gaussian spectrum), 1: rough (Ornstein-Uhlenbeck), 2: one over the frequency.

    Returns
    -------
    (*shape, count) array
    """
    # The courses are twice as long as needed, since the Fourier transform joins their ends.
    length = 2 * count
    frequency = np.fft.rfftfreq(length)
    if kind == 0:
        gain = np.exp(-0.5 * (np.pi * frequency * time) ** 2)
    elif kind == 1:
        gain = 1 / np.sqrt(1 + (2 * np.pi * frequency * time) ** 2)
    else:
        gain = 1 / np.sqrt(np.maximum(frequency, 1 / count))
        gain *= np.exp(-0.5 * (frequency * 20) ** 2)
        gain[0] = 0
    white = np.fft.rfft(numbers.standard_normal((*shape, length), dtype=np.float32), axis=-1)
    values = np.fft.irfft(white * gain, length, axis=-1)[..., :count]
    power = (gain[0] ** 2 + 2 * (gain[1:-1] ** 2).sum() + gain[-1] ** 2) / length
    return values / np.sqrt(power)


def wandering(
    numbers: np.random.Generator, wander: Wander, shape: tuple[int, ...], count: int
) -> np.ndarray:
    """Return random courses of a bench's wander, (*shape, count); each run has its own size."""
    runs = numbers.standard_normal((shape[0],) + (1,) * len(shape))
    course = smooth_noise(numbers, shape, count, wander.time, wander.kind)
    return wander.size * np.exp(wander.run_spread * runs) * course


def jumps(
    numbers: np.random.Generator, shape: tuple[int, ...], count: int, rate: float, size: float
) -> np.ndarray:
    """Return random courses (*shape, count) with `rate` sudden jumps in each on average."""
    happens = numbers.random((*shape, count), dtype=np.float32) < rate / count
    return np.cumsum(happens * numbers.normal(0, size, (*shape, count)), axis=-1)


def followed(values: np.ndarray, time: float) -> np.ndarray:
    """Return courses (..., K) after a first-order lag with a time constant in samples."""
    decay = np.exp(-1 / time)
    begin = values[..., :1]
    return begin + lfilter([1 - decay], [1, -decay], values - begin, axis=-1)


def simulate_bench(bench: RandomBench, sizes_mm: np.ndarray, streams: Streams) -> list[np.ndarray]:
    """Return simulated recordings of one bench.

    Parameters
    ----------
    bench : RandomBench
        The bench.
    sizes_mm : (n,) array
        Size of the nodule in each recording, in mm; 0 for none.
    streams : Streams
        Random numbers; with the same numbers, recordings differ only by the nodule.

    Returns
    -------
    list of n (4, K) arrays of int16
        Readings of a 10 bit converter.
    """
    sizes_mm = np.asarray(sizes_mm, dtype=float)
    nodules = _draw_nodules(bench, sizes_mm, streams)
    phase = _wave_phase_of(bench.wave, sizes_mm.size, streams)
    head = _head_way(bench, nodules, phase, streams)
    press = _presses(bench, nodules, phase, head, streams)
    counts = _counts(bench, _sensed(bench, press), streams)
    beyond = nodules.lead + SENSORS - 1 + bench.way.tail
    end = np.argmax(head > beyond[:, np.newaxis], axis=1)
    end[end == 0] = _LONGEST
    if bench.way.until_full:
        end = np.where(streams("end").random(sizes_mm.size) < 0.7, _LONGEST, end)
    end = np.maximum(end, _SHORTEST)
    return [row[:, :stop] for row, stop in zip(counts, end.tolist(), strict=True)]


@dataclass(frozen=True)
class _Nodules:
    """The nodules of a bench's runs, from its `Lump`, each (n,); `touch` is (n, S).

    `height` is in amplitudes of the wave, and `touch` a factor on it at each sensor. `width` of the
    profile and `lead`, the first sensor's distance at the start, are in pitches.
    """

    height: np.ndarray
    touch: np.ndarray
    width: np.ndarray
    lead: np.ndarray


def _draw_nodules(bench: RandomBench, sizes_mm: np.ndarray, streams: Streams) -> _Nodules:
    """Return random nodules of the given sizes (n,); size 0 has a place, but no height."""
    lump, way, count = bench.lump, bench.way, len(sizes_mm)
    known = {size: streams(f"size {size:g}").normal() for size in sorted(set(sizes_mm.tolist()))}
    alike = np.array([known[size] for size in sizes_mm.tolist()])
    own = streams("off").standard_normal(count)
    off_mm = lump.miss_mm * (np.sqrt(lump.miss_alike) * alike + np.sqrt(1 - lump.miss_alike) * own)
    met = np.exp(-0.5 * (off_mm / (0.5 * sizes_mm + 0.5 * lump.strip_mm)) ** 2)
    numbers = streams("touch")
    touch = np.exp(lump.touch_spread * numbers.standard_normal((count, SENSORS)))
    touch *= numbers.random((count, SENSORS)) >= lump.untouched_share
    lead = way.lead + way.lead_spread * streams("lead").standard_normal(count)
    return _Nodules(
        height=lump.height * (sizes_mm / 3) ** lump.growth * met,
        touch=touch,
        width=lump.width + lump.width_a_mm * sizes_mm,
        lead=np.maximum(lead, 0.05),
    )


def _wave_phase_of(wave: WaveTrain, runs: int, streams: Streams) -> np.ndarray:
    """Return a random phase of the wave at the start of the gut, (n, K), in radians."""
    numbers = streams("phase")
    begin = numbers.uniform(0, 2 * np.pi, (runs, 1))
    jitter = wave.period_jitter * smooth_noise(numbers, (runs,), _LONGEST, 80, 0)
    return begin + np.cumsum(2 * np.pi / wave.period * (1 + jitter), axis=1)


def _wave_number(phase: np.ndarray) -> np.ndarray:
    """Return the number of the wave at each sample (n, K), from 0."""
    number = np.floor(phase / (2 * np.pi)).astype(int)
    return number - number[:, :1]


def _head_way(
    bench: RandomBench, nodules: _Nodules, phase: np.ndarray, streams: Streams
) -> np.ndarray:
    """Return the place of the first sensor at each sample, (n, K), in pitches.

    The nodules slow the capsule; the phase is that of `_wave_phase_of`.
    """
    way, runs = bench.way, len(phase)
    numbers = streams("pace")
    pace = np.exp(way.run_spread * numbers.standard_normal((runs, 1))) / way.lag
    free = _free_way(way, bench.wave.period, phase, streams("strokes")) * pace
    numbers = streams("holds")
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
    number = _wave_number(phase)
    waves = int(number.max()) + 1
    stroke = np.exp(way.stroke_spread * numbers.standard_normal((runs, waves)))
    stroke *= numbers.random((runs, waves)) >= way.stick
    part = np.clip(phase / (2 * np.pi) % 1 / way.grip, 0, 1)
    part = part**2 * (3 - 2 * part)
    before = np.cumsum(stroke, axis=1) - stroke
    strokes = np.take_along_axis(before, number, 1) + part * np.take_along_axis(stroke, number, 1)
    return (strokes - strokes[:, :1]) * period


def _spent(way: Way, nodules: _Nodules, held: np.ndarray, run: int) -> np.ndarray:
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


def _presses(
    bench: RandomBench, nodules: _Nodules, phase: np.ndarray, head: np.ndarray, streams: Streams
) -> np.ndarray:
    """Return the press of the wall on each sensor, (n, S, K), in amplitudes of the wave."""
    wave, effect, disturbances = bench.wave, bench.lump.effect, bench.disturbances
    runs, count = phase.shape
    place = head[:, np.newaxis] - _BEHIND
    angle = phase[:, np.newaxis] + 2 * np.pi * (
        wave.offset_waves * _BEHIND - wave.pitch_waves * place
    )
    strength = _strength(bench, _wave_number(phase), streams)
    reach = strength * (_wave_height(wave, angle) + wave.bias)
    seat = wandering(streams("seat"), disturbances.seat, (runs, SENSORS), count)
    if disturbances.seat_jumps:
        rate, size = disturbances.seat_jumps, disturbances.seat_jump
        seat = seat + jumps(streams("seat jumps"), (runs, SENSORS), count, rate, size)
    lead, width, height = (
        each[:, np.newaxis, np.newaxis] for each in (nodules.lead, nodules.width, nodules.height)
    )
    off = (place - lead) / width
    profile = np.exp(-0.5 * np.abs(off) ** bench.lump.flatness)
    nodule = height * nodules.touch[..., np.newaxis] * profile
    near = reach + seat + effect.adds * nodule
    uneven = _unevenness(bench, place, streams("wall"))
    near = near * (1 + uneven) if disturbances.unevenness_multiplies else near + uneven
    press = _touched(wave, near) * (1 + 1.5 * effect.multiplies * nodule)
    press = press + 0.5 * effect.lifts * nodule
    return press + _touched(wave, reach - seat) if wave.both_walls else press


def _strength(bench: RandomBench, number: np.ndarray, streams: Streams) -> np.ndarray:
    """Return the random strength of each wave at each sensor, (n, S, K), about 1."""
    wave, disturbances = bench.wave, bench.disturbances
    runs, count = number.shape
    shape = (runs, SENSORS)
    common = wandering(streams("common strength"), disturbances.common_strength, (runs,), count)
    own = wandering(streams("own strength"), disturbances.own_strength, shape, count)
    waves = int(number.max()) + 1
    numbers = streams("beats")
    missing = numbers.random((runs, 1, waves)) < wave.missing_share
    beat = wave.common_beat_spread * numbers.standard_normal((runs, 1, waves))
    beat = beat + wave.own_beat_spread * numbers.standard_normal((*shape, waves))
    beat = np.exp(beat) * np.where(missing, wave.missing_height, 1.0)
    at = np.broadcast_to(number[:, np.newaxis], (*shape, count))
    wandered = np.clip(common[:, np.newaxis] + own, -2, 1.5)
    return np.exp(wandered) * np.take_along_axis(beat, at, 2)


def _wave_height(wave: WaveTrain, angle: np.ndarray) -> np.ndarray:
    """Return the wave's height at a phase, between about -1 and 1."""
    if wave.form == "sine":
        return np.cos(angle)
    if wave.form == "skewed":
        return np.cos(angle + 0.8 * wave.form_value * np.sin(angle + wave.form_angle))
    if wave.form == "power":
        return 2 * (0.5 + 0.5 * np.cos(angle)) ** (0.6 * 8**wave.form_value) - 1
    return np.cos(angle) + 0.5 * wave.form_value * np.cos(2 * angle + wave.form_angle)


def _touched(wave: WaveTrain, near: np.ndarray) -> np.ndarray:
    """Return the press, which is 0 if the wall does not reach the sensor."""
    if wave.softness == 0:
        return np.maximum(near, 0)
    return wave.softness * np.logaddexp(0, near / wave.softness)


def _unevenness(bench: RandomBench, place: np.ndarray, numbers: np.random.Generator) -> np.ndarray:
    """Return the random unevenness of each run's wall at the sensors, (n, S, K)."""
    size, length = bench.disturbances.unevenness, bench.disturbances.unevenness_length
    runs = len(place)
    turns = numbers.standard_normal((runs, _COSINES)) / length
    begin = numbers.uniform(0, 2 * np.pi, (runs, _COSINES))
    table_at = np.linspace(-5, 25, 900)
    angle = table_at[:, np.newaxis] * turns[:, np.newaxis] + begin[:, np.newaxis]
    table = size * np.sqrt(2 / _COSINES) * np.cos(angle).sum(axis=2)
    rows = [np.interp(place[run].ravel(), table_at, table[run]) for run in range(runs)]
    return np.stack(rows).reshape(place.shape)


def _sensed(bench: RandomBench, press: np.ndarray) -> np.ndarray:
    """Return the sensors' response to the presses (n, S, K): limit, echo, crosstalk, lag, creep."""
    sensing = bench.sensing
    limit = sensing.limit * (2 if bench.wave.both_walls else 1)
    press = press / (1 + (np.maximum(press, 0) / limit) ** 4) ** 0.25
    if sensing.echo:
        delay = max(int(sensing.echo_waves * bench.wave.period), 1)
        late = np.pad(press, ((0, 0), (0, 0), (delay, 0)))[..., :-delay]
        press = press + sensing.echo * late
    if sensing.crosstalk:
        beside = np.eye(SENSORS, k=1) + np.eye(SENSORS, k=-1)
        press = (np.eye(SENSORS) + sensing.crosstalk * beside) @ press
    press = followed(press, sensing.lag_time)
    if sensing.creep:
        slow = followed(press, sensing.creep_time)
        press = (1 - sensing.creep) * press + sensing.creep * slow
    return press


def _counts(bench: RandomBench, press: np.ndarray, streams: Streams) -> np.ndarray:
    """Return the readings with gain, noise, drift and the converter, (n, S, K) of int16."""
    sensing, shape = bench.sensing, press.shape
    numbers = streams("sensors")
    gain = np.exp(sensing.gain_spread * numbers.standard_normal((*shape[:2], 1)))
    rest = np.exp(sensing.rest + sensing.rest_spread * numbers.standard_normal((*shape[:2], 1)))
    noise = sensing.noise * numbers.standard_normal(shape, dtype=np.float32)
    change = press * gain + noise + _drift(bench, shape, streams)
    if sensing.spikes:
        numbers = streams("spikes")
        happens = numbers.random(shape, dtype=np.float32) < sensing.spikes
        change = change + happens * numbers.normal(0, 2, shape)
    if sensing.divider:
        ratio = rest * np.maximum(1 - sensing.counts / _COUNTS_A_SHARE * change, 0.01)
        reading = _FULL_SCALE * ratio / (1 + ratio)
    else:
        reading = _FULL_SCALE * rest / (1 + rest) - sensing.counts * change
    return np.clip(np.floor(reading), 0, _FULL_SCALE - 1).astype(np.int16)


def _drift(bench: RandomBench, shape: tuple[int, ...], streams: Streams) -> np.ndarray:
    """Return the random drift of the sensors, (n, S, K): a random walk, settling and jumps."""
    disturbances, (runs, sensors, count) = bench.disturbances, shape
    walk = streams("drift").standard_normal(shape, dtype=np.float32)
    drift = disturbances.drift / np.sqrt(count) * np.cumsum(walk, axis=-1)
    one_each = (runs, 1 if disturbances.settling_alike else sensors, 1)
    size = disturbances.settling * streams("settling").standard_normal(one_each)
    drift = drift + size * np.exp(-np.arange(count) / disturbances.settling_time)
    if disturbances.base_jumps:
        rate, height = disturbances.base_jumps, disturbances.base_jump
        drift = drift + jumps(streams("base jumps"), (runs, sensors), count, rate, height)
    return drift
