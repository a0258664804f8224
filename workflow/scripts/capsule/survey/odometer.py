"""The odometer: the capsule's position from the sensors and the phase of the drive.

A sensor at x reads ``cos(2 pi (x - w) / lambda)`` when the drive has moved the wave by w.
Multiplied by ``exp(2 pi i w / lambda)`` and averaged, this gives a phase that depends on x alone:
the place modulo one wavelength. The last known position tells which wavelength it is.

The method needs the phase of the drive, which does not exist in a real gut.
"""

import numpy as np

from capsule.arrays import ComplexArray, FloatArray, IntArray, RealArray
from capsule.detectors.wave import fill_missing
from capsule.kinds import Settings

# In units of R / R_series. A sensor with a smaller amplitude feels no wave.
_STILL = 1e-6
# A sensor with a larger share of missing samples does not count.
_MOST_MISSING = 0.25


def place_in_wave(
    pressed: FloatArray, wave_mm: FloatArray, pitch_mm: float, wavelength_mm: float
) -> float:
    """Return the head's place modulo one wavelength, in mm; NaN if not two sensors feel a wave.

    The place holds for the middle of the samples.

    Parameters
    ----------
    pressed : (S, K) array
        How hard each sensor is pressed, in any unit; NaN where a sample is missing. K should span
        two waves.
    wave_mm : (K,) array
        How far the drive has carried the wave.
    pitch_mm : float
        Distance from each sensor back to the next one.
    wavelength_mm : float
        Length of the wave.

    Returns
    -------
    float
        From -wavelength_mm / 2 to wavelength_mm / 2, from an origin that stays the same.
    """
    known, values = _known(pressed)
    count = wave_mm.size
    time = np.linspace(-1, 1, count)
    # The level is fitted by a parabola, because sensors creep after unfolding and may drift.
    level = np.stack([np.ones(count), time, time**2])
    taper = np.sin(np.pi * (np.arange(count) + 0.5) / count)
    basis = np.vstack([level, _harmonics(wave_mm, wavelength_mm)])
    fitted = np.linalg.lstsq((basis * taper).T, (values * taper).T)[0]
    return _common_place(fitted[3] + 1j * fitted[4], pitch_mm * known, wavelength_mm)


def newest_place(
    pressed: FloatArray, wave_mm: FloatArray, pitch_mm: float, wavelength_mm: float
) -> float:
    """Return the head's place as `place_in_wave` does, for the middle of the newer half.

    It lags behind by half a wave instead of a whole one. Creeping sensors disturb it more.
    """
    known, values = _known(pressed)
    count = wave_mm.size
    level = np.stack([np.ones(count), np.linspace(-1, 1, count)])
    waves = _harmonics(wave_mm, wavelength_mm)
    basis = np.vstack([level, waves[2:], waves[:2]])
    fitted = np.linalg.lstsq(basis.T, values.T)[0]
    remaining = values - fitted[:4].T @ basis[:4]
    newer = slice(count // 2, None)
    cosine, sine = np.linalg.lstsq(waves[:2, newer].T, remaining[:, newer].T)[0]
    return _common_place(cosine + 1j * sine, pitch_mm * known, wavelength_mm)


def _known(pressed: FloatArray) -> tuple[IntArray, FloatArray]:
    """Return the sensors with enough samples, (N,), and their readings with gaps filled, (N, K)."""
    known = np.flatnonzero(np.isnan(pressed).mean(axis=1) <= _MOST_MISSING)
    return known, fill_missing(pressed[known])


def _harmonics(wave_mm: FloatArray, wavelength_mm: float) -> FloatArray:
    """Return the wave at place 0 and its second harmonic, cosine and sine of each, (4, K)."""
    turns = np.exp(2j * np.pi / wavelength_mm * wave_mm)
    return np.stack([turns.real, turns.imag, (turns**2).real, (turns**2).imag])


def _common_place(phasors: ComplexArray, behind_mm: RealArray, wavelength_mm: float) -> float:
    """Return the place on which the phases of several sensors agree; NaN for fewer than two.

    Parameters
    ----------
    phasors : (N,) complex array
        Amplitude and phase of the wave on each sensor.
    behind_mm : (N,) array
        Distance of each sensor behind the head.
    """
    size = np.abs(phasors)
    moving = size > _STILL
    if np.count_nonzero(moving) < 2:
        return float("nan")
    turn = 2 * np.pi / wavelength_mm
    common = (phasors[moving] / size[moving]) @ np.exp(1j * turn * behind_mm[moving])
    return float(np.angle(common) / turn)


def nearest_turn(place_mm: float, expected_mm: float, wavelength_mm: float) -> float:
    """Return a place that is known modulo one wavelength, moved to nearest `expected_mm`."""
    return place_mm + wavelength_mm * round((expected_mm - place_mm) / wavelength_mm)


class Odometer:
    """An odometer that follows the head along the gut.

    A fix is a position found from the wave.

    Attributes
    ----------
    origin_mm : float or None
        Place in the wave of position 0, as from `place_in_wave`; None before the first fix, which
        is assumed to be at `start_mm`.
    """

    def __init__(self, settings: Settings, rate_hz: float, start_mm: float) -> None:
        self._wavelength_mm = float(settings["wavelength_mm"])
        self._pitch_mm = float(settings["pitch_mm"])
        wave = rate_hz * self._wavelength_mm / settings["wave_speed_mm_s"]
        self.span: int = 2 * round(wave)
        self.start_mm = start_mm
        self.origin_mm: float | None = None
        self._samples: list[int] = []
        self._fixes_mm: list[float] = []

    @property
    def delay(self) -> int:
        """Number of samples by which a fix lags behind the newest sample."""
        return self.span // 2

    @property
    def position_mm(self) -> float:
        """The newest fix in mm; NaN before the first."""
        return self._fixes_mm[-1] if self._fixes_mm else float("nan")

    @property
    def fixes(self) -> int:
        """Number of fixes since the capsule unfolded."""
        return len(self._fixes_mm)

    def fix(self, last: int, pressed: FloatArray, wave_mm: FloatArray, expected_mm: float) -> float:
        """Find and keep the position; NaN if no wave is felt.

        Parameters
        ----------
        last : int
            Number of the newest sample.
        pressed, wave_mm
            As in `place_in_wave`: the newest `span` samples.
        expected_mm : float
            Expected position, with an error of less than half a wavelength.
        """
        place_mm = place_in_wave(pressed, wave_mm, self._pitch_mm, self._wavelength_mm)
        if np.isnan(place_mm):
            return place_mm
        if self.origin_mm is None:
            self.origin_mm = place_mm - self.start_mm
        position_mm = nearest_turn(place_mm - self.origin_mm, expected_mm, self._wavelength_mm)
        self._samples.append(last - self.delay)
        self._fixes_mm.append(position_mm)
        return position_mm

    def newest(self, pressed: FloatArray, wave_mm: FloatArray) -> float:
        """Return the position half a wave ago, without keeping it.

        The result is NaN if no wave is felt, or if there is no earlier fix.
        """
        if not self._fixes_mm or self.origin_mm is None:
            return float("nan")
        place_mm = newest_place(pressed, wave_mm, self._pitch_mm, self._wavelength_mm)
        if np.isnan(place_mm):
            return place_mm
        return nearest_turn(place_mm - self.origin_mm, self.position_mm, self._wavelength_mm)

    def forget(self) -> None:
        """Delete all fixes, because the capsule has moved unseen; the origin stays."""
        self._samples.clear()
        self._fixes_mm.clear()

    def way(self, samples: FloatArray) -> FloatArray:
        """Return the position at some samples (N,), by straight lines between the fixes."""
        return np.interp(samples, self._samples, self._fixes_mm)

    def last_before(self, position_mm: float) -> int:
        """Return the last sample with the head before a position, or that of the first fix."""
        before = np.flatnonzero(np.array(self._fixes_mm) < position_mm)
        return self._samples[before[-1] if before.size else 0]

    def settled(self, fixes: int, spread_mm: float) -> bool:
        """Return whether the last fixes agree with a capsule that moves slowly."""
        last = self._fixes_mm[-fixes:]
        return len(last) == fixes and float(np.ptp(np.diff(last))) <= spread_mm
