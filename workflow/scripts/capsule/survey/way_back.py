"""How long to stay folded: the folded capsule's speed is learned, and nothing is taken for granted.

The odometer knows a place modulo one wavelength. So the capsule stays folded no longer than it
takes to come half a wavelength away from where it should be, however wrong the speed is.
"""

import math
from dataclasses import dataclass, replace

# No leg is slower or faster before a speed was learned; above 0 it is carried forward. Waves
# differ, so a short leg may be a third faster than the capsule is on average.
_PLAUSIBLE_MM_S = (-1.1, 0.4)
_USUAL_MM_S = -0.4
# A way, in mm, that no odometer mistakes.
_SURE_MM = 2.0
# Waves push a folded capsule by ways that differ by so much, in parts of their mean (some do not
# push it at all); so many standard deviations are allowed for.
_WAVE_SPREAD = 0.65
_DEVIATIONS = 2.5
_SHORTEST_S = 10.0
# Slower it is not worth the time.
_SLOWEST_MM_S = -0.08
_TRY_S = 25.0


@dataclass
class Leg:
    """A stretch of the way back.

    Attributes
    ----------
    from_mm : float
        Where it begins.
    begun_s : float
        When the origami was folded.
    planned_s, lasted_s : float
        For how long it was to stay folded, and stayed.
    """

    from_mm: float = float("nan")
    begun_s: float = float("nan")
    planned_s: float = 0.0
    lasted_s: float = 0.0


@dataclass(frozen=True)
class WayBack:
    """What is known of the folded capsule's speed.

    Attributes
    ----------
    wavelength_mm : float
        Within which the odometer knows a place.
    period_s : float
        Time from wave to wave.
    seconds, moved_mm : float
        Time folded, and the way in it, of all legs so far.
    """

    wavelength_mm: float
    period_s: float
    seconds: float = 0.0
    moved_mm: float = 0.0

    @property
    def speed_mm_s(self) -> float:
        """Mean speed; before the first leg an unfounded guess."""
        return self.moved_mm / self.seconds if self.seconds else _USUAL_MM_S

    def expected_mm(self, seconds: float) -> float:
        """Return how far the capsule should have moved in that time; below 0 backward."""
        if not self.seconds:
            return sum(_PLAUSIBLE_MM_S) / 2 * seconds
        return self.speed_mm_s * seconds

    def end_mm(self, leg: Leg) -> float:
        """Return where a leg should have led."""
        return leg.from_mm + self.expected_mm(leg.lasted_s)

    def longest_s(self) -> float:
        """Return how long a leg may be for the odometer to know the place afterwards."""
        low, high = _PLAUSIBLE_MM_S
        room_mm = self.wavelength_mm / 2 - _SURE_MM
        if not self.seconds:
            return room_mm / ((high - low) / 2)
        # The mean over some waves differs from the true speed, and the next leg's from it as well.
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
        """Return for how long to stay folded to go back by a way."""
        if self.speed_mm_s > _SLOWEST_MM_S:
            # It did not go back. It may have slipped, but no more gut is to be passed unfelt.
            return _TRY_S
        return min(max(way_mm / -self.speed_mm_s, _SHORTEST_S), self.longest_s())

    def learned(self, moved_mm: float, seconds: float) -> "WayBack":
        """Return what is known after a leg."""
        # The last legs count most: the gut need not be the same everywhere.
        kept = 0.7
        return replace(
            self, seconds=kept * self.seconds + seconds, moved_mm=kept * self.moved_mm + moved_mm
        )

    def went_back(self, moved_mm: float) -> bool:
        """Say whether a leg led back at all."""
        return moved_mm < -_SURE_MM
