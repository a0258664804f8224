"""What the unfolded capsule feels: where it is, and what the last samples say of the gut."""

import numpy as np

from capsule.arrays import FloatArray
from capsule.divider import pressed_and_period
from capsule.kinds import Settings
from capsule.survey.gut_evidence import GutEvidence, evidence_along
from capsule.survey.odometer import Odometer
from capsule.survey.survey_log import RESTING, UNFOLDED, Readings
from capsule.survey.survey_settings import SurveySettings

# How well fixes, a judgement apart, must agree before a position counts, in mm.
_AGREE_MM = 3.0
# A usual way from judgement to judgement, in mm, until the odometer shows how the capsule moves.
_USUAL_STEP_MM = 0.44
_FASTEST_STEP_MM = 2.0
# Of the first two strokes, how much the mean over the first two waves holds.
_FIRST_STROKES = 1.3
# How much the newest step counts.
_STEP_SHARE = 0.1


class Sensing:
    """The last samples since the capsule unfolded, and what they say.

    Parameters
    ----------
    detector : mapping
        Section ``diagonal`` of the configuration.
    rate_hz : float
        Sampling rate.
    settings : SurveySettings
        What the survey goes by.
    start_mm : float
        Where the head stands.

    Attributes
    ----------
    step_mm : float
        Way of the unfolded capsule from judgement to judgement, of late.
    resting : bool
        Whether the fold board's motor has to rest, so that the capsule travels on unfolded.
    """

    def __init__(
        self, detector: Settings, rate_hz: float, settings: SurveySettings, start_mm: float
    ) -> None:
        self._detector, self._rate_hz, self._settings = detector, rate_hz, settings
        self._odometer = Odometer(detector, rate_hz, start_mm)
        self._keep = max(settings.longest_window, self._odometer.span)
        self._count = 0
        self._values: FloatArray | None = None
        self._wave_mm = np.empty(0)
        self._last_mm = start_mm
        self._fixed_at: int | None = None
        self.step_mm = _USUAL_STEP_MM
        self.resting = False
        # The first fix holds for the end of the first stroke; the next one has part in it.
        self._odometer.start_mm = start_mm + _FIRST_STROKES * self._since_fix_mm()

    def _since_fix_mm(self) -> float:
        return self.step_mm * self._odometer.delay / self._settings.every

    @property
    def position_mm(self) -> float:
        """Where the head stands now, as far as is known; NaN before the first fix."""
        return self._odometer.position_mm + self._since_fix_mm()

    @property
    def newest_mm(self) -> float:
        """Where the head stands now, by the newest wave alone; as `position_mm` where that fails.

        It errs less than `position_mm`, unless the sensors creep.
        """
        span = self._odometer.span
        if self._values is None or self._values.shape[1] < span:
            return self.position_mm
        wave_mm = self._wave_mm[-span:]
        if np.isnan(wave_mm).any() or np.isnan(self.fix_mm):
            return self.position_mm
        newest_mm = self._odometer.newest(self._pressed(self._values), wave_mm)
        return newest_mm + self._since_fix_mm() / 2 if np.isfinite(newest_mm) else self.position_mm

    def _pressed(self, values: FloatArray) -> FloatArray:
        """Return how hard the newest samples are pressed."""
        newest = values[:, -self._odometer.span :]
        return pressed_and_period(newest, self._rate_hz, self._detector)[0]

    @property
    def head_mm(self) -> float:
        """Where the newest samples have the head; NaN where they do not tell."""
        return self.position_mm if self._fixed_at == self._count else float("nan")

    @property
    def fix_mm(self) -> float:
        """The newest fix, which holds for a moment before now; NaN before the first."""
        return self._odometer.position_mm

    @property
    def origin_mm(self) -> float | None:
        """Place in the wave of position 0; None before the first fix."""
        return self._odometer.origin_mm

    def take_origin(self, origin_mm: float) -> None:
        """Take over where an earlier map begins; it counts only before the first fix."""
        if self._odometer.origin_mm is None:
            self._odometer.origin_mm = origin_mm

    def settled(self) -> bool:
        """Say whether there are enough fixes since the capsule unfolded, and they agree."""
        return self._odometer.settled(self._settings.fixes, _AGREE_MM)

    def on_mm(self, seconds: float) -> float:
        """Return how far the unfolded capsule travels in some time."""
        return seconds * self._rate_hz / self._settings.every * self.step_mm

    @property
    def half_stroke_mm(self) -> float:
        """Half a stroke, one a wave: so much before a place is as near as so much beyond."""
        return self.on_mm(self.period_s) / 2

    @property
    def period_s(self) -> float:
        """Time from wave to wave."""
        return float(self._detector["wavelength_mm"] / self._detector["wave_speed_mm_s"])

    @property
    def blind_mm(self) -> float:
        """How far the capsule travels from when it is unfolded until its position is known."""
        return (self._settings.first_fix_ticks + self._settings.fixes) * self.step_mm

    def take(self, readings: Readings) -> None:
        """Take the newest samples.

        Those of a capsule that is not unfolded say nothing. Where all samples or the wave are
        missing, what came before says nothing of what comes now.
        """
        self._count += readings.time_s.size
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
        """Find the position; say whether it is found.

        Parameters
        ----------
        expected_mm : float, optional
            Where the capsule should be, off by less than half a wavelength; without it, near where
            it was. It counts only before the first fix.
        """
        span, before_mm = self._odometer.span, self._odometer.position_mm
        if self._values is None or self._values.shape[1] < span:
            return False
        wave_mm = self._wave_mm[-span:]
        if np.isnan(wave_mm).any():
            return False
        if not np.isnan(before_mm):
            expected_mm = before_mm + self.step_mm
        elif expected_mm is None:
            expected_mm = self._last_mm
        fix_mm = self._odometer.fix(
            self._count - 1, self._pressed(self._values), wave_mm, expected_mm
        )
        if np.isnan(fix_mm):
            return False
        self._last_mm, self._fixed_at = fix_mm, self._count
        if not np.isnan(before_mm):
            step_mm = float(np.clip(fix_mm - before_mm, 0.0, _FASTEST_STEP_MM))
            self.step_mm += _STEP_SHARE * (step_mm - self.step_mm)
        return True

    def evidence(self) -> GutEvidence | None:
        """Judge the last samples; None where they say nothing."""
        values, window = self._values, self._settings.window
        if values is None or values.shape[1] < window or self._odometer.fixes < 2:
            return None
        # A capsule that is held has not passed enough gut in the usual time.
        since = self._count - self._odometer.last_before(self.fix_mm - self._settings.window_mm)
        values = values[:, -min(max(window, since), values.shape[1]) :]
        if self._any_still(values[:, -self._odometer.span :]):
            return None
        first = self._count - values.shape[1]
        return evidence_along(
            values, self._rate_hz, self._detector, lambda at: self._odometer.way(first + at)
        )

    @staticmethod
    def _any_still(values: FloatArray) -> bool:
        """Say whether a sensor has died: it would look as if nothing pressed it."""
        highest = np.nanmax(values, axis=1, initial=-np.inf)
        return bool(np.any(highest <= np.nanmin(values, axis=1, initial=np.inf)))
