"""The sliding comparison of a particle or template with a recording (eq. F' to eq. RMSEmin).

The particle slides over the recording in a frame of 3 L columns and never leaves it. Therefore
|F' - P' R^(tau-1)|^2 = |F|^2 + |P|^2 - 2 sum F P(shifted). The best of the 2 L lags is the maximum
of one cross-correlation, summed over the sensors. This is the convolution of the particle with the
recording reversed in time. Let w be the number of columns from the recording's first value to its
last. The convolution differs from 0 only at the L + w - 1 lags where the particle overlaps these
columns. These lags and one lag without overlap hold every value, so FFTs of L + w elements or more
keep them apart.
"""

import itertools
from functools import cached_property, lru_cache

import numpy as np

from capsule.arrays import ComplexArray, FloatArray, IntArray


def rmse_at_lag(matrix: FloatArray, particle: FloatArray, lag: int) -> float:
    """Return the RMSE at one lag, by the formula (eq. F', eq. P', eq. shiftMatrix, eq. RMSE).

    Parameters
    ----------
    matrix, particle : (S, L) array
        The recording's matrix F, and the particle P that slides over it.
    lag : int
        tau in 1..2L; at tau = L + 1 the two matrices coincide.

    Returns
    -------
    float
        RMSE(tau), a root mean square over the frame of S x 3L elements.
    """
    sensors, length = matrix.shape
    if not 1 <= lag <= 2 * length:
        raise ValueError(f"lag {lag} is outside 1..{2 * length}")
    frame = np.zeros((sensors, 3 * length))
    frame[:, length : 2 * length] = matrix
    frame[:, lag - 1 : lag - 1 + length] -= particle
    # In place, because a new array takes longer than the arithmetic.
    squares = np.square(frame, out=frame)
    return float(np.sqrt(np.add.reduce(squares, axis=None) / squares.size))


class RepeatedParticle:
    """A particle or template that is compared with many recordings: its spectra are kept.

    Parameters
    ----------
    values : (S, L) array
        The particle P. It must not change afterwards.

    Attributes
    ----------
    values : (S, L) array
    is_known : bool
        Whether no value is NaN.
    """

    def __init__(self, values: FloatArray) -> None:
        self.values = values
        self.is_known = not np.isnan(values).any()
        self._kept: dict[int, tuple[ComplexArray, float]] = {}

    def __reduce__(self) -> tuple[type["RepeatedParticle"], tuple[FloatArray]]:
        """Let a pickle hold the values alone: the spectra are larger, and can be made again."""
        return RepeatedParticle, (self.values,)

    def spectra(self, size: int) -> tuple[ComplexArray, float]:
        """Return the spectrum of each sensor with FFTs of `size` elements, and |P|^2."""
        if size not in self._kept:
            sensors, length = self.values.shape
            frame = np.zeros((sensors, size))
            frame[:, :length] = self.values
            flat = frame.reshape(-1)
            self._kept[size] = np.fft.rfft(frame), float(np.vecdot(flat, flat))
        return self._kept[size]


class SlidingComparison:
    """A comparison of many particles with one recording, several at once.

    The caller draws the particles into `particles`, or passes one to `gain_of`. The spectrum of
    the recording is made once, and so are the buffers of `gains`, which a fit calls thousands of
    times. `gain_of` needs no buffers, so that a detector can keep the comparisons of thousands of
    recordings.

    Parameters
    ----------
    matrix : (S, L) array
        The recording's matrix F.
    at_once : int
        B, how many particles are compared at once. A larger B makes each comparison cheaper, until
        the buffers outgrow the processor's cache.

    Attributes
    ----------
    length : int
        L.
    particles : (B, S, L) array
        The particles to compare, drawn here before `gains` is called; a view of padded frames.
    """

    def __init__(self, matrix: FloatArray, at_once: int = 1) -> None:
        sensors, length = matrix.shape
        filled = np.flatnonzero(matrix.any(axis=0))
        first, end = (filled[0], filled[-1] + 1) if filled.size else (0, 1)
        self.length, self._rows = length, (at_once, sensors)
        # Element m of the convolution is the particle shifted by end - 1 - m = tau - 1 - L.
        self._last_lag, self._count = length + end, length + end - first
        self._size = fast_length(self._count)
        self._reversed = np.fft.rfft(matrix[:, first:end][:, ::-1], self._size)

    @cached_property
    def _frames(self) -> FloatArray:
        # Padded here, because numpy uses vector registers for two rows at a time only if the rows
        # have the full length.
        return np.zeros((*self._rows, self._size))

    @cached_property
    def particles(self) -> FloatArray:
        """Where particles are drawn, (B, S, L)."""
        return self._frames[:, :, : self.length]

    @cached_property
    def _buffers(self) -> tuple[ComplexArray, ComplexArray, FloatArray]:
        at_once, frequencies = self._rows[0], self._reversed.shape[1]
        spectra = np.empty((*self._rows, frequencies), dtype=np.complex128)
        summed = np.empty((at_once, frequencies), dtype=np.complex128)
        return spectra, summed, np.empty((at_once, self._size))

    def gains(self, count: int) -> tuple[FloatArray, IntArray]:
        """Return the best lags of the particles drawn into `particles`, and their gains.

        Parameters
        ----------
        count : int
            How many of `particles` are compared, from the first on, 1..B.

        Returns
        -------
        gains : (count,) array
            The largest 2 sum F P(shifted) - |P|^2. A particle lowers |F|^2 by this gain:
            RMSE^2 = (|F|^2 - gain) / (3 S L). The smallest RMSE has the largest gain.
        lags : (count,) array of int
            tau in 1..2L of the largest gain.
        """
        frames = self._frames[:count]
        spectra, summed, convolved = self._buffers
        spectra, summed, convolved = spectra[:count], summed[:count], convolved[:count]
        np.fft.rfft(frames, out=spectra)
        np.multiply(spectra, self._reversed, out=spectra)
        np.add.reduce(spectra, axis=1, out=summed)
        np.fft.irfft(summed, self._size, out=convolved)
        correlation = convolved[:, : self._count]
        values = frames.reshape(count, -1)
        gains = 2.0 * correlation.max(axis=1) - np.vecdot(values, values)
        return gains, self._last_lag - correlation.argmax(axis=1)

    def gain_of(self, particle: RepeatedParticle) -> tuple[float, int]:
        """Return the gain and the lag of a particle whose spectra are kept; see `gains`."""
        spectra, energy = particle.spectra(self._size)
        if energy == 0.0:
            # The zero matrix of no nodule has the same gain at all lags.
            return 0.0, int(self._last_lag)
        summed = np.add.reduce(spectra * self._reversed, axis=0)
        convolved = np.fft.irfft(summed, self._size)
        best = int(convolved[: self._count].argmax())
        return 2.0 * float(convolved[best]) - energy, int(self._last_lag - best)


@lru_cache(maxsize=256)
def fast_length(least: int) -> int:
    """Return the next length whose FFT is fast: a multiple of 16 without prime factors above 5."""
    for length in itertools.count(-(-least // 16) * 16, 16):
        rest = length
        for prime in (2, 3, 5):
            while rest % prime == 0:
                rest //= prime
        if rest == 1:
            break
    return length
