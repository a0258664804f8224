"""Simulate the recordings of a random bench: from wave, wall and nodule to counts."""

import numpy as np

from scorer_teaching.bench_family import RandomBench, WaveTrain
from scorer_teaching.random_numbers import Streams, followed, jumps, wandering
from scorer_teaching.travel import (
    LONGEST,
    SENSORS,
    Nodules,
    draw_nodules,
    head_way,
    wave_number,
    wave_phase_of,
)

_FULL_SCALE = 1024
_SHORTEST = 250
_BEHIND = np.arange(SENSORS)[:, np.newaxis]
# Number of cosines in the model of an uneven wall.
_COSINES = 12
# At half of the scale, a relative change x of the resistance changes a reading by 256 x counts.
_COUNTS_A_SHARE = 256


def simulate_bench(bench: RandomBench, sizes_mm: np.ndarray, streams: Streams) -> list[np.ndarray]:
    """Return simulated recordings of one bench.

    Parameters
    ----------
    bench : RandomBench
        Bench from `scorer_teaching.bench_family.draw_bench`.
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
    nodules = draw_nodules(bench, sizes_mm, streams)
    phase = wave_phase_of(bench.wave, sizes_mm.size, streams)
    head = head_way(bench, nodules, phase, streams)
    press = _presses(bench, nodules, phase, head, streams)
    counts = _counts(bench, _sensed(bench, press), streams)
    beyond = nodules.lead + SENSORS - 1 + bench.way.tail
    end = np.argmax(head > beyond[:, np.newaxis], axis=1)
    end[end == 0] = LONGEST
    if bench.way.until_full:
        end = np.where(streams.of("end").random(sizes_mm.size) < 0.7, LONGEST, end)
    end = np.maximum(end, _SHORTEST)
    return [row[:, :stop] for row, stop in zip(counts, end.tolist(), strict=True)]


def _presses(
    bench: RandomBench, nodules: Nodules, phase: np.ndarray, head: np.ndarray, streams: Streams
) -> np.ndarray:
    """Return the press of the wall on each sensor, (n, S, K), in amplitudes of the wave."""
    wave, lump, disturbances = bench.wave, bench.lump, bench.disturbances
    runs, count = phase.shape
    place = head[:, np.newaxis] - _BEHIND
    angle = phase[:, np.newaxis] + 2 * np.pi * (
        wave.offset_waves * _BEHIND - wave.pitch_waves * place
    )
    strength = _strength(bench, wave_number(phase), streams)
    reach = strength * (_wave_height(wave, angle) + wave.bias)
    seat = wandering(streams.of("seat"), disturbances.seat, (runs, SENSORS), count)
    if disturbances.seat_jumps:
        seat = seat + jumps(
            streams.of("seat jumps"),
            (runs, SENSORS),
            count,
            disturbances.seat_jumps,
            disturbances.seat_jump,
        )
    off = (place - nodules.lead[:, np.newaxis, np.newaxis]) / nodules.width[
        :, np.newaxis, np.newaxis
    ]
    profile = np.exp(-0.5 * np.abs(off) ** lump.flatness)
    nodule = (nodules.height[:, np.newaxis] * nodules.touch)[..., np.newaxis] * profile
    near = reach + seat + lump.adds * nodule
    uneven = _unevenness(bench, place, streams.of("wall"))
    near = near * (1 + uneven) if disturbances.unevenness_multiplies else near + uneven
    press = _touched(wave, near) * (1 + 1.5 * lump.multiplies * nodule) + 0.5 * lump.lifts * nodule
    return press + _touched(wave, reach - seat) if wave.both_walls else press


def _strength(bench: RandomBench, number: np.ndarray, streams: Streams) -> np.ndarray:
    """Return the random strength of each wave at each sensor, (n, S, K), about 1."""
    wave, disturbances = bench.wave, bench.disturbances
    runs, count = number.shape
    shape = (runs, SENSORS)
    common = wandering(streams.of("common strength"), disturbances.common_strength, (runs,), count)
    own = wandering(streams.of("own strength"), disturbances.own_strength, shape, count)
    waves = int(number.max()) + 1
    numbers = streams.of("beats")
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
    numbers = streams.of("sensors")
    gain = np.exp(sensing.gain_spread * numbers.standard_normal((*shape[:2], 1)))
    rest = np.exp(sensing.rest + sensing.rest_spread * numbers.standard_normal((*shape[:2], 1)))
    noise = sensing.noise * numbers.standard_normal(shape, dtype=np.float32)
    change = press * gain + noise + _drift(bench, shape, streams)
    if sensing.spikes:
        numbers = streams.of("spikes")
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
    walk = streams.of("drift").standard_normal(shape, dtype=np.float32)
    drift = disturbances.drift / np.sqrt(count) * np.cumsum(walk, axis=-1)
    one_each = (runs, 1 if disturbances.settling_alike else sensors, 1)
    size = disturbances.settling * streams.of("settling").standard_normal(one_each)
    drift = drift + size * np.exp(-np.arange(count) / disturbances.settling_time)
    if disturbances.base_jumps:
        rate, height = disturbances.base_jumps, disturbances.base_jump
        drift = drift + jumps(streams.of("base jumps"), (runs, sensors), count, rate, height)
    return drift
