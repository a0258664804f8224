"""The sliding comparison of a particle or template with a recording (eq. F' to eq. RMSEmin).

The particle slides over the recording in a frame of 3 L columns, which none of its columns ever
leaves, so |F' - P' R^(tau-1)|^2 = |F|^2 + |P|^2 - 2 sum F P(shifted): the best of the 2 L lags is
the maximum of one cross-correlation, summed over the sensors. A circular correlation of length
2 L holds all of these lags without overlap.
"""

import numpy as np


def rmse_at_lag(matrix: np.ndarray, particle: np.ndarray, lag: int) -> float:
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
    """Compares many particles with one recording.

    The particle is drawn into `particle` (or handed to `compare`); the spectrum of the recording
    and all buffers are made once.

    Parameters
    ----------
    matrix : (S, L) array
        The recording's matrix F.

    Attributes
    ----------
    particle : (S, L) array
        Where the particle is drawn before `gain` is called; a view of the zero-padded frame.
    """

    def __init__(self, matrix: np.ndarray) -> None:
        sensors, length = matrix.shape
        self.matrix = matrix
        self._frame = np.zeros((sensors, 2 * length))
        self._flat_frame = self._frame.reshape(-1)
        self.particle = self._frame[:, :length]
        self._conjugate = np.conj(np.fft.rfft(matrix, 2 * length, axis=1))
        self._spectrum = np.empty_like(self._conjugate)
        self._summed = np.empty(length + 1, dtype=self._conjugate.dtype)
        self._correlation = np.empty(2 * length)

    def gain(self) -> tuple[float, int]:
        """Find the best lag of what is drawn in `particle`.

        Returns
        -------
        gain : float
            The largest 2 sum F P(shifted) - |P|^2, by which the particle lowers |F|^2:
            RMSE^2 = (|F|^2 - gain) / (3 S L). The smallest RMSE has the largest gain.
        lag : int
            tau in 1..2L where it is reached.
        """
        length = self.matrix.shape[1]
        np.fft.rfft(self._frame, axis=1, out=self._spectrum)
        np.multiply(self._spectrum, self._conjugate, out=self._spectrum)
        np.add.reduce(self._spectrum, axis=0, out=self._summed)
        np.fft.irfft(self._summed, 2 * length, out=self._correlation)
        # Element m of the circular correlation is the shift by -m columns, tau - 1 - L = -m.
        best = int(self._correlation.argmax())
        shift = -best if best <= length else 2 * length - best
        energy = self._flat_frame.dot(self._flat_frame)
        return 2.0 * float(self._correlation[best]) - float(energy), shift + length + 1

    def compare(self, particle: np.ndarray) -> tuple[float, int]:
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
