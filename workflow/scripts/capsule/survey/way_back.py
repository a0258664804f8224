"""The plan of the way back: how long to stay folded, from the learned speed of the folded capsule.

The odometer knows a place modulo one wavelength. The capsule therefore unfolds before its position
can be half a wavelength from the expected one, even if the speed is wrong.
"""

import math
from dataclasses import dataclass, replace

# Limits of the speed before one is learned; above 0 the capsule moves forward. Waves differ, so a
# short leg may be a third faster than the average.
_PLAUSIBLE_MM_S = (-1.1, 0.4)
_USUAL_MM_S = -0.4
# Margin in mm for the error of the odometer.
_SURE_MM = 2.0
# Relative standard deviation of the ways by which waves push a folded capsule (some do not push it
# at all), and the number of standard deviations that the plan allows for.
_WAVE_SPREAD = 0.65
_DEVIATIONS = 2.5
_SHORTEST_S = 10.0
# A slower way back is not worth the time.
_SLOWEST_MM_S = -0.08
_TRY_S = 25.0


@dataclass
class Leg:
    """One leg of the way back: the time from folding to unfolding."""

    from_mm: float = float("nan")
    begun_s: float = float("nan")
    planned_s: float = 0.0
    lasted_s: float = 0.0


@dataclass(frozen=True)
class WayBack:
    """The knowledge of the folded capsule's speed.

    Attributes
    ----------
    wavelength_mm : float
        Length of the wave; the odometer knows a place modulo this length.
    period_s : float
        Time from wave to wave.
    seconds, moved_mm : float
        Sums over the legs so far, recent legs weighted most: time folded, and way in that time.
    """

    wavelength_mm: float
    period_s: float
    seconds: float = 0.0
    moved_mm: float = 0.0

    @property
    def speed_mm_s(self) -> float:
        """Mean speed; before the first leg, a guess without any measurement."""
        return self.moved_mm / self.seconds if self.seconds else _USUAL_MM_S

    def expected_mm(self, seconds: float) -> float:
        """Return how far the capsule should have moved in this time; below 0 means backward."""
        if not self.seconds:
            return sum(_PLAUSIBLE_MM_S) / 2 * seconds
        return self.speed_mm_s * seconds

    def end_mm(self, leg: Leg) -> float:
        """Return the expected position at the end of a leg."""
        return leg.from_mm + self.expected_mm(leg.lasted_s)

    def longest_s(self) -> float:
        """Return the longest leg after which the odometer still knows the place."""
        low, high = _PLAUSIBLE_MM_S
        room_mm = self.wavelength_mm / 2 - _SURE_MM
        if not self.seconds:
            return room_mm / ((high - low) / 2)
        # Both the learned mean and the next leg's mean differ from the true speed.
        spread = _DEVIATIONS * _WAVE_SPREAD
        known = spread * math.sqrt(self.period_s / self.seconds)
        fastest_mm_s = abs(low)
        if known < 1:
            off_mm_s = _DEVIATIONS * _SURE_MM / self.seconds
            fastest_mm_s = min(fastest_mm_s, (abs(self.speed_mm_s) + off_mm_s) / (1 - known))
        error_mm_s = fastest_mm_s - abs(self.speed_mm_s)
        by_chance = spread * fastest_mm_s * math.sqrt(self.period_s)
        # The longest t with error t + chance sqrt(t) = room.
        root = math.sqrt(by_chance**2 + 4 * error_mm_s * room_mm)
        return ((root - by_chance) / (2 * error_mm_s)) ** 2

    def leg_s(self, way_mm: float) -> float:
        """Return how long to stay folded to go back by this way."""
        if self.speed_mm_s > _SLOWEST_MM_S:
            # The capsule did not go back. It may have slipped. A short leg keeps it from passing
            # more gut without sensing.
            return _TRY_S
        return min(max(way_mm / -self.speed_mm_s, _SHORTEST_S), self.longest_s())

    def learned(self, moved_mm: float, seconds: float) -> "WayBack":
        """Return the knowledge after a leg."""
        # The last legs count most, because the gut may differ from place to place.
        kept = 0.7
        return replace(
            self, seconds=kept * self.seconds + seconds, moved_mm=kept * self.moved_mm + moved_mm
        )

    def went_back(self, moved_mm: float) -> bool:
        """Return whether a leg moved the capsule back."""
        return moved_mm < -_SURE_MM
