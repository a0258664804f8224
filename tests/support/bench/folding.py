"""Simulate the origami on its thread, from the fold board's motor to its end switches."""

from support.bench.emulated import PIN_2, PIN_3, EmulatedBoard

TRAVEL = 1900  # half-steps that fold the unfolded origami
SWITCH_TRAVEL = 40  # half-steps before each end at which its switch closes


class FoldingOrigami:
    """A world in which the motor winds the thread, and the thread closes the end switches.

    `wound` is in half-steps, from 0 (unfolded) to `TRAVEL` (folded); below 0 the thread is slack.
    A test may set it, as somebody who pulls the thread.
    """

    def __init__(self, board: EmulatedBoard, wound: float = 0) -> None:
        self._board, self._before, self.wound = board, board.half_steps, wound
        self()

    @property
    def folded(self) -> float:
        """The folded share of the origami: 0 or 1 if an end switch is closed."""
        way = (self.wound - SWITCH_TRAVEL) / (TRAVEL - 2 * SWITCH_TRAVEL)
        return min(max(way, 0.0), 1.0)

    def __call__(self) -> None:
        """Move the thread by the motor's half-steps in the last stretch of time."""
        now = self._board.half_steps
        # The completely folded origami stops the motor.
        self.wound = min(self.wound + now - self._before, TRAVEL + SWITCH_TRAVEL)
        self._before = now
        self._board.set_switch(PIN_2, self.wound < SWITCH_TRAVEL)
        self._board.set_switch(PIN_3, self.wound > TRAVEL - SWITCH_TRAVEL)
