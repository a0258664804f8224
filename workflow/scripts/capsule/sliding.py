"""The sliding comparison of a particle or template with a recording (eq. F' to eq. RMSEmin).

The particle slides over the recording in a frame of 3 L columns, which none of its columns ever
leaves, so |F' - P' R^(tau-1)|^2 = |F|^2 + |P|^2 - 2 sum F P(shifted): the best of the 2 L lags is
the maximum of one cross-correlation, summed over the sensors. That is the convolution of the
particle with the recording reversed in time. It differs from 0 only where the particle meets the
w columns from the recording's first value to its last, at L + w - 1 lags: these and one lag
without a meeting hold every value, and FFTs of at least L + w elements keep them apart.
"""

import itertools

import numpy as np

from capsule.arrays import FloatArray, IntArray


def rmse_at_lag(matrix: FloatArray, particle: FloatArray, lag: int) -> float:
    """Compute the RMSE at one lag, by the formula (eq. F', eq. P', eq. shiftMatrix, eq. RMSE).

    Parameters
    ----------
    matrix, particle : (S, L) array
        The recording's matrix F, and the particle P that slides over it.
    lag : int
        tau in 1..2L; at tau = L + 1 both lie on each other.

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
    return float(np.sqrt(np.mean(frame**2)))


class SlidingComparison:
    """Compares many particles with one recording, some at once.

    The particles are drawn into `particles` (or one is handed to `compare`); the spectrum of the
    recording and all buffers are made once.

    Parameters
    ----------
    matrix : (S, L) array
        The recording's matrix F.
    at_once : int
        B, how many particles are compared at once. Each then costs less, as calls and FFTs serve
        several, until the buffers outgrow the processor's cache.

    Attributes
    ----------
    particles : (B, S, L) array
        Where particles are drawn before `gains` is called; a view of the zero-padded frames.
    particle : (S, L) array
        The first of them, for `gain`.
    """

    def __init__(self, matrix: FloatArray, at_once: int = 1) -> None:
        sensors, length = matrix.shape
        self.matrix = matrix
        filled = np.flatnonzero(matrix.any(axis=0))
        first, end = (filled[0], filled[-1] + 1) if filled.size else (0, 1)
        # Element m of the convolution is the particle shifted by end - 1 - m = tau - 1 - L.
        self._lags = length + end - np.arange(length + end - first)
        self._size = fast_length(self._lags.size)
        self._reversed = np.fft.rfft(matrix[:, first:end][:, ::-1], self._size)
        frequencies = self._reversed.shape[1]
        # Padded here, as numpy transforms only whole rows two by two in vector registers.
        self._frames = np.zeros((at_once, sensors, self._size))
        self.particles = self._frames[:, :, :length]
        self.particle = self.particles[0]
        self._spectra = np.empty((at_once, sensors, frequencies), dtype=np.complex128)
        self._summed = np.empty((at_once, frequencies), dtype=np.complex128)
        self._convolved = np.empty((at_once, self._size))

    def gains(self, count: int) -> tuple[FloatArray, IntArray]:
        """Find the best lags of what is drawn in the first of `particles`.

        Parameters
        ----------
        count : int
            How many of them are compared, 1..B.

        Returns
        -------
        gains : (count,) array
            The largest 2 sum F P(shifted) - |P|^2, by which a particle lowers |F|^2:
            RMSE^2 = (|F|^2 - gain) / (3 S L). The smallest RMSE has the largest gain.
        lags : (count,) array of int
            tau in 1..2L where it is reached.
        """
        frames, spectra = self._frames[:count], self._spectra[:count]
        summed, convolved = self._summed[:count], self._convolved[:count]
        np.fft.rfft(frames, out=spectra)
        np.multiply(spectra, self._reversed, out=spectra)
        np.add.reduce(spectra, axis=1, out=summed)
        np.fft.irfft(summed, self._size, out=convolved)
        correlation = convolved[:, : self._lags.size]
        values = frames.reshape(count, -1)
        gains = 2.0 * correlation.max(axis=1) - np.vecdot(values, values)
        return gains, self._lags[correlation.argmax(axis=1)]

    def gain(self) -> tuple[float, int]:
        """Find the best lag of what is drawn in `particle`; see `gains`."""
        gains, lags = self.gains(1)
        return float(gains[0]), int(lags[0])

    def compare(self, particle: FloatArray) -> tuple[float, int]:
        """Find the smallest RMSE over all lags (eq. RMSEmin).

        Parameters
        ----------
        particle : (S, L) array
            The particle or template.

        Returns
        -------
        rmse : float
            The smallest RMSE, computed by the formula at the best lag.
        lag : int
            tau in 1..2L; where several lags tie (a zero particle), one of them.
        """
        self.particle[...] = particle
        _, lag = self.gain()
        return rmse_at_lag(self.matrix, particle, lag), lag


def fast_length(least: int) -> int:
    """Give the next length whose FFT is fast: a multiple of 16 without primes above 5."""
    for length in itertools.count(-(-least // 16) * 16, 16):
        rest = length
        for prime in (2, 3, 5):
            while rest % prime == 0:
                rest //= prime
        if rest == 1:
            break
    return length
