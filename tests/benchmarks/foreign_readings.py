"""Readings that come from no capsule: noise of many kinds, and recordings of other sensors."""

import gzip
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
from scipy.signal import butter, lfilter, sosfiltfilt

SAMPLES, RATE_HZ, SENSORS = 600, 10.0, 4
# Longest and shortest recording that is cut from a longer one.
LONGEST, SHORTEST = 950, 300
Numbers = np.random.Generator
Noise = Callable[[Numbers], np.ndarray]


def white(numbers: Numbers) -> np.ndarray:
    """Return white noise of four sensors, (4, K), of any strength."""
    return numbers.normal(500, numbers.uniform(0.5, 60), (SENSORS, SAMPLES)).round()


def last_bit(numbers: Numbers) -> np.ndarray:
    """Return sensors of which only the last bit toggles."""
    return 500.0 + (numbers.random((SENSORS, SAMPLES)) < 0.5)


def walk(numbers: Numbers) -> np.ndarray:
    """Return sensors that drift at random."""
    steps = numbers.normal(0, numbers.uniform(0.3, 6), (SENSORS, SAMPLES))
    return np.clip(500 + steps.cumsum(axis=1), 0, 1023).round()


def slow(numbers: Numbers) -> np.ndarray:
    """Return noise whose neighbouring samples are alike."""
    return (500 + _slow_rows(numbers, SENSORS, SAMPLES)).round()


def hum(numbers: Numbers) -> np.ndarray:
    """Return slow noise that all channels share, such as that of the supply."""
    return (slow(numbers)[:1] + numbers.normal(0, 1, (SENSORS, SAMPLES))).round()


INDEPENDENT: dict[str, Noise] = {
    "white noise": white,
    "a toggling last bit": last_bit,
    "a random walk": walk,
    "slow noise": slow,
    "slow noise that all channels share": hum,
}

# Rows of noise (rows, K) by the number of rows and samples.
_Rows = Callable[[Numbers, int, int], np.ndarray]


def _slow_rows(numbers: Numbers, rows: int, samples: int) -> np.ndarray:
    recursion = [1, -numbers.uniform(0.5, 0.99)]
    return lfilter([1], recursion, numbers.normal(0, 8, (rows, 200 + samples)), axis=1)[:, 200:]


def _walk_rows(numbers: Numbers, rows: int, samples: int) -> np.ndarray:
    return numbers.normal(0, 1, (rows, samples)).cumsum(axis=1)


def _pink_rows(numbers: Numbers, rows: int, samples: int) -> np.ndarray:
    frequency = np.maximum(np.fft.rfftfreq(samples), 1 / samples)
    lines = np.fft.rfft(numbers.normal(size=(rows, samples)), axis=1)
    made = np.fft.irfft(lines / frequency ** numbers.uniform(0.25, 1.0), samples, axis=1)
    return 15 * made / made.std()


def _band_rows(numbers: Numbers, rows: int, samples: int) -> np.ndarray:
    """Return noise of a band around the wave's frequency."""
    width = numbers.uniform(0.03, 0.5)
    band = butter(2, [0.3125 * (1 - width), 0.3125 * (1 + width)], "band", fs=RATE_HZ, output="sos")
    made = sosfiltfilt(band, numbers.normal(size=(rows, samples + 400)), axis=1)[:, 200:-200]
    return 20 * made / made.std()


def _pulse_rows(numbers: Numbers, rows: int, samples: int) -> np.ndarray:
    """Return one row of pulses that come more or less regularly, as of another gut."""
    width, mean, jitter = numbers.uniform(1.5, 6), numbers.uniform(20, 48), numbers.uniform(0, 0.4)
    gaps = mean * np.maximum(0.2, 1 + jitter * numbers.normal(size=int(samples / mean) * 3 + 9))
    heights = np.maximum(0, 1 + numbers.uniform(0, 0.6) * numbers.normal(size=gaps.size))
    off = np.arange(samples)[:, np.newaxis] - gaps.cumsum()
    return -30 * (np.exp(-0.5 * (off / width) ** 2) @ heights)[np.newaxis].repeat(rows, axis=0)


def _breath_rows(numbers: Numbers, rows: int, samples: int) -> np.ndarray:
    """Return one row of a rhythm that wanders, as of breathing."""
    wander = lfilter([0.05], [1, -0.95], numbers.normal(size=samples))
    turn = 2 * np.pi * numbers.uniform(0.02, 0.055) * (1 + 3 * numbers.uniform(0, 0.6) * wander)
    phase = turn.cumsum()
    made = np.sin(phase) + numbers.uniform(0, 0.8) * np.sin(2 * phase + numbers.uniform(0, 6))
    return 20 * made[np.newaxis].repeat(rows, axis=0)


def _chirp_rows(numbers: Numbers, rows: int, samples: int) -> np.ndarray:
    """Return one row of a tone whose frequency rises or falls through that of the wave."""
    first, last = numbers.permutation([numbers.uniform(0.1, 0.3), numbers.uniform(0.32, 0.7)])
    phase = 2 * np.pi * np.linspace(first, last, samples).cumsum() / RATE_HZ
    return 25 * np.sin(phase)[np.newaxis].repeat(rows, axis=0)


def _step_rows(numbers: Numbers, rows: int, samples: int) -> np.ndarray:
    """Return one row of a sawtooth with pauses, as of a pump that is switched."""
    period = int(numbers.integers(20, 50))
    running = np.repeat(numbers.random(samples // 60 + 2) < 0.75, 60)[:samples]
    return 30 * (np.where(running, np.arange(samples) % period, 0) / period)[np.newaxis].repeat(
        rows, axis=0
    )


def _beat_rows(numbers: Numbers, rows: int, samples: int) -> np.ndarray:
    """Return one row of two rhythms at once, as of heart and breath."""
    time_s = np.arange(samples) / RATE_HZ
    made = np.zeros(samples)
    for low, high in ((0.15, 0.4), (0.8, 1.6)):
        made += numbers.uniform(5, 20) * np.sin(2 * np.pi * numbers.uniform(low, high) * time_s)
    return made[np.newaxis].repeat(rows, axis=0)


def _coupled(rows: _Rows) -> Noise:
    """Return noise that neighbouring sensors share in part."""

    def noise(numbers: Numbers) -> np.ndarray:
        shared = numbers.uniform(0.2, 0.8) ** np.abs(np.subtract.outer(*[np.arange(SENSORS)] * 2))
        return _as_counts(numbers, shared @ rows(numbers, SENSORS, SAMPLES))

    return noise


def _travelling(rows: _Rows) -> Noise:
    """Return noise that reaches one sensor after the other."""

    def noise(numbers: Numbers) -> np.ndarray:
        delay = int(numbers.integers(1, 12))
        row = rows(numbers, 1, SAMPLES + SENSORS * delay)[0]
        made = np.stack([row[s * delay :][:SAMPLES] for s in range(SENSORS)])
        return _as_counts(numbers, made[:: numbers.choice([-1, 1])])

    return noise


def _as_counts(numbers: Numbers, values: np.ndarray) -> np.ndarray:
    loud = np.clip(500 + values * numbers.uniform(0.5, 4), 1, 1022)
    return (loud + numbers.normal(0, numbers.uniform(0, 2), values.shape)).round()


COUPLED: dict[str, Noise] = {
    "slow noise, shared by neighbours": _coupled(_slow_rows),
    "a random walk, shared by neighbours": _coupled(_walk_rows),
    "pink noise, shared by neighbours": _coupled(_pink_rows),
    "noise around the wave's frequency, shared by neighbours": _coupled(_band_rows),
}
TRAVELLING: dict[str, Noise] = {
    "slow noise that travels": _travelling(_slow_rows),
    "pink noise that travels": _travelling(_pink_rows),
    "noise around the wave's frequency that travels": _travelling(_band_rows),
    "pulses that travel": _travelling(_pulse_rows),
    "breathing that travels": _travelling(_breath_rows),
}
# These had no part in choosing the traits of a wave or what counts as familiar.
JUDGED_ONLY: dict[str, Noise] = {
    "a rising or falling tone that travels": _travelling(_chirp_rows),
    "a switched sawtooth that travels": _travelling(_step_rows),
    "two rhythms at once that travel": _travelling(_beat_rows),
}


def other_sensors(folder: Path) -> Iterator[tuple[str, np.ndarray]]:
    """Yield recordings of other sensors, four channels each, with what they come from.

    Parameters
    ----------
    folder : Path
        The folder of ``fabricslide`` and ``gastropy``. Long recordings are cut, and some are sped
        up, towards the rhythm of the wave.
    """
    for path in sorted((folder / "fabricslide").rglob("*.csv")):
        channels = np.loadtxt(path, delimiter=",", skiprows=1)[:, 3:].T
        what = "a finger on ridges" if path.name.startswith("Board") else "a finger on fabric"
        for speed in (1.0, 1.5, 2.0, 3.6, 5.0):
            yield from ((what, each) for each in _fours(_faster(channels, speed)))
    for path in sorted((folder / "gastropy").glob("*.tsv.gz")):
        with gzip.open(path) as stream:
            channels = np.loadtxt(stream)[:, :8].T
        centred = channels - channels.mean(axis=1, keepdims=True)
        counts = 500 + 100 * centred / centred.std()
        for speed in (1.0, 2.0, 3.0, 4.5, 6.25, 12.5):
            yield from (("electrogastrography", each) for each in _fours(_faster(counts, speed)))


def _fours(channels: np.ndarray) -> Iterator[np.ndarray]:
    """Yield neighbouring channels, every one and every second, in pieces."""
    for step in (1, 2):
        for first in range(len(channels) - (SENSORS - 1) * step):
            four = channels[first : first + SENSORS * step : step]
            for start in range(0, four.shape[1], LONGEST):
                piece = four[:, start : start + LONGEST]
                if piece.shape[1] >= SHORTEST and (piece.std(axis=1) > 0).all():
                    yield piece


def _faster(channels: np.ndarray, speed: float) -> np.ndarray:
    """Return channels as they would be at a higher speed, smoothed over a new sample."""
    width = max(int(speed), 1)
    smooth = np.stack([np.convolve(row, np.ones(width) / width, "same") for row in channels])
    at = np.arange(0, channels.shape[1] - 1, speed)
    return np.stack([np.interp(at, np.arange(channels.shape[1]), row) for row in smooth])
