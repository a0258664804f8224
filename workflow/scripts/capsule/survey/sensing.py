"""Sensing of the unfolded capsule: its position, and the evidence of the last samples."""

import numpy as np

from capsule.arrays import FloatArray
from capsule.kinds import Settings
from capsule.recordings.units import pressed_and_period
from capsule.survey.gut_evidence import GutEvidence, evidence_along
from capsule.survey.odometer import Odometer
from capsule.survey.survey_log import RESTING, UNFOLDED, Readings

# Start of the gut, where the head is at first. Nothing pushes the capsule beyond it.
START_MM = 0.0
# Number of samples from one judgement to the next.
EVERY = 8
# Smallest and largest number of samples for the evidence, and the way that they should cover.
_WINDOW, _LONGEST_WINDOW, _WINDOW_MM = 400, 1500, 21.0
# Number of judgements until the first fix after unfolding, and number of agreeing fixes that make
# the position known.
_FIRST_FIX_TICKS, _FIXES = 8, 4
# Largest difference between the steps of successive fixes before a position counts, in mm.
_AGREE_MM = 3.0
# Usual way between two judgements, in mm, until the odometer measures it.
_USUAL_STEP_MM = 0.44
_FASTEST_STEP_MM = 2.0
# Mean way over the first two waves, in strokes.
_FIRST_STROKES = 1.3
# A capsule that is not felt may be so many times as fast as usual.
_FASTER = 1.3
# Weight of the newest step in the running mean.
_STEP_SHARE = 0.1


class Sensing:
    """The last samples since the capsule unfolded, with its position and the evidence in them.

    Parameters
    ----------
    detector : mapping
        Section ``diagonal`` of the configuration.
    rate_hz : float
        Sampling rate.

    Attributes
    ----------
    step_mm : float
        Recent mean way of the unfolded capsule between two judgements.
    resting : bool
        True while the motor of the fold board rests, so that the capsule travels on unfolded.
    may_be_off_mm : float
        Error that the position may have from now on: one wavelength, once the capsule was not felt
        for so long that it may have travelled half of one; else 0.
    """

    def __init__(self, detector: Settings, rate_hz: float) -> None:
        self._detector, self._rate_hz = detector, rate_hz
        self._odometer = Odometer(detector, rate_hz, START_MM)
        self._keep = max(_LONGEST_WINDOW, self._odometer.span)
        self._count = 0
        self._values: FloatArray | None = None
        self._wave_mm = np.empty(0)
        self._last_mm = START_MM
        self._fixed_at: int | None = None
        self.step_mm = _USUAL_STEP_MM
        self.resting = False
        self.may_be_off_mm = 0.0
        # The first fix is a mean over the first stroke and part of the next one.
        self._odometer.start_mm = START_MM + _FIRST_STROKES * self._since_fix_mm()

    def _since_fix_mm(self) -> float:
        return self.step_mm * self._odometer.delay / EVERY

    @property
    def now_s(self) -> float:
        """Time of the newest sample, in seconds."""
        return round(max(self._count - 1, 0) / self._rate_hz, 3)

    @property
    def position_mm(self) -> float:
        """Present position of the head as far as known, in mm; NaN before the first fix."""
        return self._odometer.position_mm + self._since_fix_mm()

    @property
    def newest_mm(self) -> float:
        """Present position of the head by the newest wave alone, or else `position_mm`.

        Its error is smaller than that of `position_mm`, unless the sensors creep.
        """
        newest = self._newest()
        if newest is None:
            return self.position_mm
        newest_mm = self._odometer.newest(*newest)
        return newest_mm + self._since_fix_mm() / 2 if np.isfinite(newest_mm) else self.position_mm

    def _newest(self) -> tuple[FloatArray, FloatArray] | None:
        """Return the newest samples as the odometer takes them; None if some are missing."""
        span = self._odometer.span
        if self._values is None or self._values.shape[1] < span:
            return None
        wave_mm = self._wave_mm[-span:]
        if np.isnan(wave_mm).any():
            return None
        pressed, _ = pressed_and_period(self._values[:, -span:], self._rate_hz, self._detector)
        return pressed, wave_mm

    @property
    def head_mm(self) -> float:
        """Position of the head by the newest samples; NaN if they do not show it."""
        return self.position_mm if self._fixed_at == self._count else float("nan")

    @property
    def fix_mm(self) -> float:
        """The newest fix, which holds for an earlier sample; NaN before the first fix."""
        return self._odometer.position_mm

    def settled(self) -> bool:
        """Return whether enough fixes since the capsule unfolded agree."""
        return self._odometer.settled(_FIXES, _AGREE_MM)

    def on_mm(self, seconds: float) -> float:
        """Return how far the unfolded capsule travels in this time."""
        return seconds * self._rate_hz / EVERY * self.step_mm

    @property
    def half_stroke_mm(self) -> float:
        """Half of the way that the capsule moves with each wave."""
        return self.on_mm(self.period_s) / 2

    @property
    def period_s(self) -> float:
        """Time from wave to wave, in seconds."""
        return float(self._detector["wavelength_mm"] / self._detector["wave_speed_mm_s"])

    @property
    def blind_mm(self) -> float:
        """Way of the capsule from unfolding until its position is known."""
        return (_FIRST_FIX_TICKS + _FIXES) * self.step_mm

    def take(self, readings: Readings) -> None:
        """Add the newest samples.

        Samples of a capsule that is not unfolded are dropped. If all samples or the wave are
        missing, the earlier samples are dropped as well.
        """
        self._count += readings.values.shape[1]
        self.resting = readings.fold == RESTING
        missing = np.isnan(readings.values).all() or np.isnan(readings.wave_mm).all()
        if missing or (readings.fold != UNFOLDED and not self.resting):
            self._values = None
            return
        if self._values is None:
            self._odometer.forget()
            self._values, self._wave_mm = readings.values[:, :0], readings.wave_mm[:0]
        self._values = np.concatenate([self._values, readings.values], axis=1)[:, -self._keep :]
        self._wave_mm = np.concatenate([self._wave_mm, readings.wave_mm])[-self._keep :]

    def follow(self, expected_mm: float | None = None) -> bool:
        """Find the position, and return whether it is found.

        Parameters
        ----------
        expected_mm : float, optional
            Expected position, with an error of less than half a wavelength; by default, the last
            known position. It counts only before the first fix.
        """
        newest, before_mm = self._newest(), self._odometer.position_mm
        if newest is None:
            return False
        unfelt_mm = 0.0
        if not np.isnan(before_mm):
            expected_mm = before_mm + self.step_mm
        elif expected_mm is None:
            expected_mm = self._last_mm
            since = self._count if self._fixed_at is None else self._fixed_at
            unfelt_mm = _FASTER * self.on_mm((self._count - since) / self._rate_hz)
        fix_mm = self._odometer.fix(self._count - 1, *newest, expected_mm)
        if np.isnan(fix_mm):
            return False
        self._last_mm, self._fixed_at = fix_mm, self._count
        if unfelt_mm > self._detector["wavelength_mm"] / 2:
            self.may_be_off_mm = float(self._detector["wavelength_mm"])
        if not np.isnan(before_mm):
            step_mm = float(np.clip(fix_mm - before_mm, 0.0, _FASTEST_STEP_MM))
            self.step_mm += _STEP_SHARE * (step_mm - self.step_mm)
        return True

    def evidence(self) -> GutEvidence | None:
        """Return the evidence of the last samples; None if they have none."""
        values = self._values
        if values is None or values.shape[1] < _WINDOW or self._odometer.fixes < 2:
            return None
        # A capsule that is held up needs more samples than usual to pass enough gut.
        since = self._count - self._odometer.last_before(self.fix_mm - _WINDOW_MM)
        values = values[:, -min(max(_WINDOW, since), values.shape[1]) :]
        newest = values[:, -self._odometer.span :]
        highest = np.nanmax(newest, axis=1, initial=-np.inf)
        if np.any(highest <= np.nanmin(newest, axis=1, initial=np.inf)):
            # A sensor has failed: constant readings look as if nothing pressed it.
            return None
        first = self._count - values.shape[1]
        return evidence_along(
            values, self._rate_hz, self._detector, lambda at: self._odometer.way(first + at)
        )
