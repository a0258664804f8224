"""What a printed conductive sensor does beside following its load: pure functions on arrays.

Each is the identity, or adds nothing, where its strength is 0.
"""

from itertools import accumulate

import numpy as np


def low_pass(signal: np.ndarray, time_constant_s: float, rate_hz: float) -> np.ndarray:
    """Return the first-order response to a signal (S, K) that rested at its first value before."""
    samples = signal.shape[-1]
    if time_constant_s <= 0:
        return signal
    decay = np.exp(-1 / (rate_hz * time_constant_s))
    kernel = (1 - decay) * decay ** np.arange(samples)
    rest = signal[..., :1]
    length = 2 * samples
    spectrum = np.fft.rfft(signal - rest, length) * np.fft.rfft(kernel, length)
    return rest + np.fft.irfft(spectrum, length)[..., :samples]


def hysteresis(compression_mm: np.ndarray, share: float, width_mm: float) -> np.ndarray:
    """Return the compression as a sensor with play follows it, in mm: shape (S, K).

    A share of the response is carried by a play operator (backlash): it follows only once the
    load has turned back by the whole width, so loading and unloading take different ways, at any
    speed (M. A. Krasnosel'skii and A. V. Pokrovskii, Systems with Hysteresis, 1989).

    Parameters
    ----------
    compression_mm
        Compression, shape (S, K).
    share
        Part of the response that has play, 0..1.
    width_mm
        Width of the play: the loop's width along the load.
    """
    if share == 0:
        return compression_mm
    half = width_mm / 2

    def follow(held: float, load: float) -> float:
        return max(load - half, min(load + half, held))

    held = [list(accumulate(row, follow)) for row in compression_mm.tolist()]
    return (1 - share) * compression_mm + share * np.array(held)


def release_peak(
    compression_mm: np.ndarray, strength: float, time_s: float, rate_hz: float
) -> np.ndarray:
    """Return what a sensor shows beside its load as it is released, in mm: shape (S, K).

    While the polymer springs back its network of carbon is disturbed once more, in proportion to
    the speed of release, and recovers with a time constant: a second peak after the first.

    Parameters
    ----------
    compression_mm
        Compression, shape (S, K).
    strength
        Height of the second peak, in parts of a compression that is released at once.
    time_s
        Time in which it decays.
    rate_hz
        Sampling rate.
    """
    if strength == 0:
        return np.zeros_like(compression_mm)
    released = np.maximum(-np.diff(compression_mm, prepend=compression_mm[:, :1]), 0.0)
    decay = np.exp(-1 / (rate_hz * time_s))
    # The low-pass gives a sudden release the height 1 - decay.
    return strength * low_pass(released, time_s, rate_hz) / (1 - decay)


def crosstalk(signal: np.ndarray, share: float) -> np.ndarray:
    """Return the signals with a share of each neighbour's added: shape (S, K).

    Neighbours are glued and wired side by side, so that one that is pressed strains the next.
    """
    if share == 0:
        return signal
    mixed = signal.copy()
    mixed[1:] += share * signal[:-1]
    mixed[:-1] += share * signal[1:]
    return mixed


def base_line_jumps(
    generator: np.random.Generator,
    shape: tuple[int, int],
    jumps_per_s: float,
    size: float,
    recovery_s: float,
    rate_hz: float,
) -> np.ndarray:
    """Return how far each sensor's base line has jumped, relative to its resistance: shape (S, K).

    A joint that works loose or a crack that opens changes the resistance at once; the polymer
    creeps back. Jumps come at random (Poisson) moments, in each sensor at its own.

    Parameters
    ----------
    shape
        Sensors S and samples K.
    jumps_per_s
        Mean number of jumps of a sensor a second.
    size
        Standard deviation of a jump.
    recovery_s
        Time constant with which the base line returns.
    """
    if size == 0 or jumps_per_s == 0:
        return np.zeros(shape)
    jumped = generator.random(shape) < jumps_per_s / rate_hz
    steps = np.where(jumped, generator.normal(0.0, size, shape), 0.0)
    decay = np.exp(-1 / (rate_hz * recovery_s))
    # The low-pass gives a sudden step the height 1 - decay; before the run nothing had jumped.
    steps[:, 0] = 0.0
    return low_pass(steps, recovery_s, rate_hz) / (1 - decay)
