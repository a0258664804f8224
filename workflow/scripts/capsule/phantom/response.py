"""What a printed conductive sensor does beside following its load: pure functions on arrays.

Each is the identity, or adds nothing, where its strength is 0.
"""

from itertools import accumulate

import numpy as np

from capsule.arrays import FloatArray


def low_pass(
    signal: FloatArray, time_constant_s: float, rate_hz: float, before: FloatArray | None = None
) -> FloatArray:
    """Return the first-order response to a signal (S, K).

    Parameters
    ----------
    before
        Response at the sample before, shape (S, 1); without it the signal rested at its first
        value.
    """
    samples = signal.shape[-1]
    if time_constant_s <= 0:
        return signal
    decay = np.exp(-1 / (rate_hz * time_constant_s))
    kernel = (1 - decay) * decay ** np.arange(samples)
    rest = signal[..., :1] if before is None else before
    length = 2 * samples
    spectrum = np.fft.rfft(signal - rest, length) * np.fft.rfft(kernel, length)
    return rest + np.fft.irfft(spectrum, length)[..., :samples]


def play(
    compression_mm: FloatArray, width_mm: float, before: FloatArray | None = None
) -> FloatArray:
    """Return what a play operator (backlash) holds while it follows a load, in mm: shape (S, K).

    It follows only once the load has turned back by the whole width, so loading and unloading take
    different ways, at any speed (M. A. Krasnosel'skii and A. V. Pokrovskii, Systems with
    Hysteresis, 1989).

    Parameters
    ----------
    compression_mm
        Compression, shape (S, K).
    width_mm
        Width of the play: the loop's width along the load.
    before
        What it held at the sample before, shape (S, 1); without it, the first compression.
    """
    half = width_mm / 2

    def follow(held: float, load: float) -> float:
        return max(load - half, min(load + half, held))

    begin = compression_mm[:, :1] if before is None else before
    rows = zip(compression_mm.tolist(), begin[:, 0].tolist(), strict=True)
    return np.array([list(accumulate(row, follow, initial=held))[1:] for row, held in rows])


def hysteresis(compression_mm: FloatArray, held_mm: FloatArray, share: float) -> FloatArray:
    """Return the compression of which a share, 0..1, has the play that `play` follows it with."""
    return (1 - share) * compression_mm + share * held_mm


def release_peak(
    compression_mm: FloatArray,
    strength: float,
    time_s: float,
    rate_hz: float,
    before: tuple[FloatArray, FloatArray] | None = None,
) -> FloatArray:
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
    before
        Compression and second peak at the sample before, each of shape (S, 1).
    """
    if strength == 0:
        return np.zeros_like(compression_mm)
    load, peak = (compression_mm[:, :1], None) if before is None else before
    released = np.maximum(-np.diff(compression_mm, prepend=load), 0.0)
    # The low-pass gives a sudden release the height 1 - decay.
    height = 1 - np.exp(-1 / (rate_hz * time_s))
    rest = None if peak is None else peak * height / strength
    peaks: FloatArray = strength * low_pass(released, time_s, rate_hz, rest) / height
    return peaks


def crosstalk(signal: FloatArray, share: float) -> FloatArray:
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
) -> FloatArray:
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
    jumps: FloatArray = low_pass(steps, recovery_s, rate_hz) / (1 - decay)
    return jumps
