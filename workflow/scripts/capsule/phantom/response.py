"""Model the imperfections of a printed conductive sensor, such as lag, hysteresis and jumps.

With a strength of 0, each function leaves its signal unchanged or adds nothing.
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
        Response at the previous sample, shape (S, 1). If it is not given, the signal was constant
        before.
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
    """Return the output of a play operator (backlash) that follows a load, in mm: shape (S, K).

    After the load turns back, the output moves only once the load has moved by the whole width. So
    loading and unloading take different paths, at any speed (M. A. Krasnosel'skii and
    A. V. Pokrovskii, Systems with Hysteresis, 1989).

    Parameters
    ----------
    compression_mm
        Compression, shape (S, K).
    width_mm
        Width of the play: the loop's width along the load.
    before
        Output at the previous sample, shape (S, 1); the first compression if not given.
    """
    half = width_mm / 2

    def follow(held: float, load: float) -> float:
        return max(load - half, min(load + half, held))

    begin = compression_mm[:, :1] if before is None else before
    rows = zip(compression_mm.tolist(), begin[:, 0].tolist(), strict=True)
    return np.array([list(accumulate(row, follow, initial=held))[1:] for row, held in rows])


def hysteresis(compression_mm: FloatArray, held_mm: FloatArray, share: float) -> FloatArray:
    """Return the mean of compression and output of `play`; the latter has the weight `share`."""
    return (1 - share) * compression_mm + share * held_mm


def release_peak(
    compression_mm: FloatArray,
    strength: float,
    time_s: float,
    rate_hz: float,
    before: tuple[FloatArray, FloatArray] | None = None,
) -> FloatArray:
    """Return the second peak that a sensor shows when it is released, in mm: shape (S, K).

    When the polymer springs back, its carbon network is disturbed again, in proportion to the speed
    of release. It recovers with a time constant.

    Parameters
    ----------
    compression_mm
        Compression, shape (S, K).
    strength
        Height of the second peak, as a fraction of a compression that is released at once.
    time_s
        Time constant of its decay.
    rate_hz
        Sampling rate.
    before
        Compression and second peak at the previous sample, each of shape (S, 1).
    """
    if strength == 0:
        return np.zeros_like(compression_mm)
    load, peak = (compression_mm[:, :1], None) if before is None else before
    released = np.maximum(-np.diff(compression_mm, prepend=load), 0.0)
    # The low-pass turns a sudden release into a peak of height 1 - decay; scale it to 1.
    height = 1 - np.exp(-1 / (rate_hz * time_s))
    rest = None if peak is None else peak * height / strength
    peaks: FloatArray = strength * low_pass(released, time_s, rate_hz, rest) / height
    return peaks


def crosstalk(signal: FloatArray, share: float) -> FloatArray:
    """Return the signals with a share of each neighbour's signal added: shape (S, K).

    Neighbours are glued together, so a pressed substructure strains the next one.
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
    """Return the jumps of each sensor's base line, relative to its resistance: shape (S, K).

    A joint that loosens or a crack that opens changes the resistance at once. The polymer then
    creeps back. Jumps are random (Poisson) and independent between sensors.

    Parameters
    ----------
    shape
        Sensors S and samples K.
    jumps_per_s
        Mean number of jumps per sensor and second.
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
    # The low-pass scales a sudden step by 1 - decay. There is no jump before the run.
    steps[:, 0] = 0.0
    jumps: FloatArray = low_pass(steps, recovery_s, rate_hz) / (1 - decay)
    return jumps
