"""The pilot of a survey: it turns readings into commands for the boards, and logs its reasons."""

from collections.abc import Callable, Sequence

import numpy as np

from capsule.kinds import Settings
from capsule.survey import cycle as cycles
from capsule.survey.cycle import Cycle
from capsule.survey.sensing import EVERY, START_MM, Sensing
from capsule.survey.survey_log import (
    FOLDED,
    FOLDING,
    UNFOLDED,
    UNFOLDING,
    UNKNOWN_FOLD,
    Event,
    Readings,
)
from capsule.survey.suspects import Suspects
from capsule.survey.way_back import Leg, WayBack

_UNKNOWN = float("nan")
# Distance before the place at which the first sensor should begin a repeated pass, and the smallest
# at which it can begin.
_RUN_UP_MM, _TOO_NEAR_MM = 7.0, 3.0
# Longest time for a move of the origami; a longer move has failed.
_LATEST_S = 10.0
# Longest time that a fold board may say nothing while the origami unfolds.
_PATIENCE_S = 60.0
# Longest time to find the position, and to pass a place again; then the survey gives up.
_LONGEST_FINDING_S, _LONGEST_PASS_S = 60.0, 600.0
# Distance before a target at which a way back should end, besides the way until the position is
# known. The capsule stops most precisely after it has followed its own approach.
_APPROACH_MM = 10.0
# A way back that should lead this far beyond the start of the gut surely ends at the start.
_SURELY_MM = 10.0


class Pilot:
    """A pilot that leads a capsule along a gut."""

    # Number of samples that one tick should hold.
    every = EVERY

    def __init__(
        self, detector: Settings, rate_hz: float, sensors: int, targets_mm: Sequence[float] = ()
    ) -> None:
        self.cycle = Cycle()
        self.log: list[Event] = []
        self.sensing = Sensing(detector, rate_hz)
        self.suspects = Suspects((sensors - 1) * detector["pitch_mm"])
        self._targets_mm = list(targets_mm)
        self._way_back = WayBack(float(detector["wavelength_mm"]), self.sensing.period_s)
        self._since_s = self._silent_s = 0.0
        # Whether the origami has begun to fold in the present state.
        self._folds = False
        self._leg: Leg

    def tick(self, readings: Readings) -> tuple[str, ...]:
        """Process the newest samples and return the commands for the boards."""
        self.sensing.take(readings)
        self.suspects.newest_score = _UNKNOWN
        judge: Callable[[str], tuple[str, ...]] = getattr(self, f"_in_{self.cycle.state}")
        return judge(readings.fold)

    def tell(
        self, event: str, reason: str, score: float = _UNKNOWN, threshold: float = _UNKNOWN
    ) -> tuple[str, ...]:
        """Process an event, log it, and return the commands for the boards.

        No reading shows ``stopped``, ``gut_ended`` and ``fault``: they come from outside.
        """
        before = self.cycle.state
        self.cycle, commands = cycles.after(self.cycle, event)
        if self.cycle.state != before:
            self._since_s, self._folds = self.sensing.now_s, False
            if self.cycle.state == "folding":
                self._leg = self._next_leg()
        # Whatever ends the examination of a place: without a decision it stays undecided.
        if self.cycle.state in ("exploring", "closing", "ended"):
            self.suspects.close("undecided")
        position_mm = float(np.round(self.sensing.position_mm, 3))
        states = before, event, self.cycle.state
        self.log.append(Event(self.sensing.now_s, *states, reason, position_mm, score, threshold))
        return commands

    @property
    def following(self) -> str:
        """The survey's next action and when it comes, in words."""
        goal = f"target {self._targets_mm[0]:.0f} mm" if self._targets_mm else "the place"
        match self.cycle.state:
            case "exploring":
                return "folds when it suspects a place, and tests it again"
            case "finishing":
                return "folds when the place is passed"
            case "folding":
                return f"then {self._leg.planned_s:.0f} s of way back"
            case "returning":
                left_s = max(self._leg.planned_s - self._leg.lasted_s, 0.0)
                return f"unfolds in {left_s:.0f} s"
            case "unfolding":
                return "then finds its position"
            case "finding":
                left_s = max(_LONGEST_FINDING_S - self._waited_s, 0.0)
                return f"then goes to {goal}; gives up in {left_s:.0f} s"
            case "passing":
                left_s = max(_LONGEST_PASS_S - self._waited_s, 0.0)
                return f"decides when the place is passed; gives up in {left_s:.0f} s"
            case "approaching":
                return f"stops the wave at {goal}"
        return ""

    @property
    def _waited_s(self) -> float:
        """Time since the present state began, in seconds."""
        return self.sensing.now_s - self._since_s

    # One method for each state, called with the state that the fold board reports.

    def _in_starting(self, fold: str) -> tuple[str, ...]:
        if fold != UNFOLDED:
            if self._waited_s > _LATEST_S and fold != UNKNOWN_FOLD:
                return self.tell("fault", f"the origami is {fold}")
            return (cycles.UNFOLD,)
        self.sensing.follow()
        if not self.sensing.settled():
            return ()
        if self._targets_mm:
            return self._towards_target()
        return self.tell("placed", "the wave is felt")

    def _in_exploring(self, fold: str) -> tuple[str, ...]:
        if fold in (FOLDING, FOLDED):
            return self.tell("fault", f"the origami is {fold} without a command to fold")
        if self._targets_mm:
            if self.cycle.no_return:
                return self.tell("cannot_arrive", "folding does not bring the capsule back")
            return self._towards_target()
        if not self.sensing.follow() or (evidence := self.sensing.evidence()) is None:
            return ()
        place = self.suspects.look(evidence, self.sensing.fix_mm)
        if place is None:
            return ()
        place.may_be_off_mm = self.sensing.may_be_off_mm
        reason = f"place {place.number}: evidence at {place.first_mm:.0f} mm"
        return self.tell("suspected", reason, self.suspects.newest_score, place.threshold)

    def _in_finishing(self, fold: str) -> tuple[str, ...]:
        if self.sensing.follow() and (evidence := self.sensing.evidence()) is not None:
            self.suspects.look_closer(evidence, self.sensing.fix_mm)
        if not self.suspects.is_beyond(self.sensing.position_mm):
            return ()
        place = self.suspects.present
        self.suspects.end_first_pass()
        reason = f"place {place.number} at {place.first_mm:.0f} mm was passed"
        return self.tell("passed", reason, place.evidence[-1])

    def _in_folding(self, fold: str) -> tuple[str, ...]:
        if fold == FOLDED:
            self._leg.begun_s = self.sensing.now_s
            return self.tell("folded", f"for {self._leg.planned_s:.0f} s")
        # A board that was reset, or found a fault, lets the origami go.
        if fold == UNFOLDING or (self._folds and fold == UNFOLDED):
            return self.tell("let_go", f"the origami is {fold}")
        self._folds |= fold == FOLDING
        if self.sensing.resting and self.sensing.follow():
            self._since_s, self._leg = self.sensing.now_s, self._next_leg()
        if self._waited_s <= _LATEST_S:
            return self._quietly("tick")
        return self.tell("late", "the origami does not fold")

    def _in_returning(self, fold: str) -> tuple[str, ...]:
        self._leg.lasted_s = self.sensing.now_s - self._leg.begun_s
        if fold != FOLDED:
            return self.tell("let_go", f"the origami is {fold}")
        if self._leg.lasted_s >= self._leg.planned_s:
            return self.tell("far_enough", "the planned time is over")
        return self._quietly("tick")

    def _in_unfolding(self, fold: str) -> tuple[str, ...]:
        if fold == UNFOLDED:
            return self.tell("unfolded", "finding the position")
        # A board whose link is lost unfolds by itself, and its link may come back: then it begins
        # to unfold once more.
        if fold == UNKNOWN_FOLD and self._waited_s <= _PATIENCE_S:
            self._silent_s = self.sensing.now_s
        if self.sensing.now_s - max(self._since_s, self._silent_s) > _LATEST_S:
            return self.tell("late", f"the origami does not unfold: it is {fold}")
        return (cycles.UNFOLD,)

    def _in_finding(self, fold: str) -> tuple[str, ...]:
        self.sensing.follow(max(self._way_back.end_mm(self._leg), START_MM))
        if not self.sensing.settled():
            if self._reckons_to_have_arrived():
                return self.tell("arrived", "computed from the start of the gut")
            if self._waited_s <= _LONGEST_FINDING_S:
                return ()
            return self.tell("lost", "the position is not found")
        back_at_mm = self.sensing.position_mm - self.sensing.on_mm(self._waited_s)
        moved_mm = back_at_mm - self._leg.from_mm
        if self._leg.lasted_s > 0:
            self._way_back = self._way_back.learned(moved_mm, self._leg.lasted_s)
        return self._after_leg(moved_mm)

    def _in_passing(self, fold: str) -> tuple[str, ...]:
        if self.sensing.follow() and (evidence := self.sensing.evidence()) is not None:
            self.suspects.look_again(evidence)
        if not self.suspects.is_beyond(self.sensing.position_mm):
            if self._waited_s <= _LONGEST_PASS_S:
                return ()
            return self.tell("lost", "the capsule does not pass the place again")
        place = self.suspects.present
        outcome = self.suspects.end_pass()
        reason = f"place {place.number}: evidence {place.heights[-1]:.1f} times the usual"
        if outcome == "again":
            return self.tell("again", reason, place.evidence[-1])
        return self.tell(outcome, reason, place.evidence[-1], self.suspects.threshold.threshold)

    def _in_approaching(self, fold: str) -> tuple[str, ...]:
        self.sensing.follow()
        return self._towards_target()

    def _in_arrived(self, fold: str) -> tuple[str, ...]:
        return self.tell("tick", "the wave is stopped")

    def _in_closing(self, fold: str) -> tuple[str, ...]:
        if fold == UNFOLDED:
            return self.tell("unfolded", "the survey is over")
        if self._waited_s > _LATEST_S:
            return self.tell("late", "the origami does not unfold")
        return self._quietly("tick")

    def _in_ended(self, fold: str) -> tuple[str, ...]:
        return ()

    # Methods that several states use.

    def _after_leg(self, moved_mm: float) -> tuple[str, ...]:
        """Continue after a way back."""
        if self.cycle.no_return and not self._targets_mm:
            return self.tell("gone_on", "the place was given up")
        position_mm, goal_mm = self.sensing.position_mm, self._goal_mm()
        reason = f"moved by {moved_mm:.1f} mm, {position_mm - goal_mm:.1f} mm from the goal"
        if moved_mm > 0:
            self.suspects.jump()
        # The start of the gut stops the capsule, so it cannot come nearer to the goal.
        held_up = min(self._way_back.end_mm(self._leg), goal_mm) < START_MM
        # A way back may end a little too early.
        early_mm = self.sensing.half_stroke_mm if self._targets_mm else _RUN_UP_MM - _TOO_NEAR_MM
        if position_mm <= goal_mm + early_mm or held_up:
            if self._targets_mm:
                return self.tell("goal_ahead", reason)
            return self.tell("placed", reason)
        if self._leg.lasted_s > 0 and self._way_back.went_back(moved_mm):
            return self.tell("short", reason)
        return self.tell("not_back", reason)

    def _towards_target(self) -> tuple[str, ...]:
        """Go on to the present target, or to the next one."""
        half_mm = self.sensing.half_stroke_mm  # The factors below leave no bias on simulated guts.
        off_mm = self._targets_mm[0] - self.sensing.newest_mm
        while abs(off_mm) <= 2 * half_mm and len(self._targets_mm) > 1:
            self.tell("reached", f"target {self._targets_mm.pop(0):.0f} mm")
            off_mm = self._targets_mm[0] - self.sensing.newest_mm
        reason = f"target {self._targets_mm[0]:.0f} mm is {off_mm:.1f} mm ahead"
        if off_mm < -1.5 * half_mm:
            return self.tell("goal_behind", reason)
        if self.cycle.state != "approaching":
            return self.tell("goal_ahead", reason)
        return self.tell("arrived", reason) if off_mm <= 0.75 * half_mm else ()

    def _reckons_to_have_arrived(self) -> bool:
        """Return whether the capsule must be at a target that is too near the start for fixes."""
        surely = self._way_back.end_mm(self._leg) <= START_MM - _SURELY_MM
        if not self._targets_mm or self._leg.lasted_s == 0 or not surely:
            return False
        reckoned_mm = START_MM + self.sensing.on_mm(self._waited_s)
        return self._goal_mm() - reckoned_mm <= self.sensing.half_stroke_mm

    def _goal_mm(self) -> float:
        """Return where a way back should end."""
        if self._targets_mm:
            return self._targets_mm[0]
        return self.suspects.present.first_mm - _RUN_UP_MM

    def _next_leg(self) -> Leg:
        """Return a plan for the way back from the present position."""
        way_mm = self.sensing.position_mm - self._goal_mm() + self.sensing.blind_mm
        if self._targets_mm:
            near = self._goal_mm() - START_MM < self.sensing.blind_mm
            way_mm += 1.5 * _SURELY_MM if near else _APPROACH_MM
        return Leg(self.sensing.position_mm, planned_s=self._way_back.leg_s(way_mm))

    def _quietly(self, event: str) -> tuple[str, ...]:
        self.cycle, commands = cycles.after(self.cycle, event)
        return commands
