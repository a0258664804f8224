"""Positions of the wave by the board's clock and its index, after resets and lost steps."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from capsule.bench.protocol import Position
from capsule.bench.timeline import BoardClock
from capsule.bench.wave import WavePhase
from support.bench.emulated import HALF_STEPS_PER_MM


# Kills: a least delay that never ages, so that a slow clock falls behind by minutes a day.
def test_a_board_whose_clock_is_slow_is_followed():
    clock = BoardClock()
    moments_s = [clock.moment_s(100 * number, 0.1005 * number) for number in range(10_000)]
    assert moments_s[-1] == pytest.approx(0.1005 * 9_999)


WAVELENGTH_MM = 80.0
SPEED_MM_S = 25.0
EVERY_S = 0.2


class Board:
    """A simulated peristalsis board with the true position of its cams, and the phase by it."""

    def __init__(self, *, sign=1, index_at_mm=17.0, indexed=True, cam_mm=3.0):
        self.sign, self.index_at_mm, self.cam_mm, self.now_s = sign, index_at_mm, cam_mm, 100.0
        self.origin_mm, self.indexed = cam_mm, indexed
        self.phase = WavePhase(WAVELENGTH_MM, forward=sign > 0)
        self.reset()

    def reset(self):
        """Press the reset button."""
        self.started_s, self.counted_mm, self.index_mm = self.now_s, 0.0, None

    def run(self, seconds, *, delay_s=0.01, stalled=False, state="running"):
        """Run the wave, and pass its frames to the phase."""
        speed_mm_s = SPEED_MM_S if state == "running" else 0.0
        for _ in range(round(seconds / EVERY_S)):
            self.now_s += EVERY_S
            self.counted_mm += speed_mm_s * EVERY_S
            if not stalled:
                turns = (self.cam_mm - self.index_at_mm) // WAVELENGTH_MM
                self.cam_mm += speed_mm_s * EVERY_S
                beyond_mm = self.cam_mm - self.index_at_mm - (turns + 1) * WAVELENGTH_MM
                if self.indexed and beyond_mm >= 0:
                    self.index_mm = self.counted_mm - beyond_mm
            moment_ms = round(1000 * (self.now_s - self.started_s))
            way_mm, speed = round(self.sign * self.counted_mm, 3), self.sign * speed_mm_s
            steps, index = map(self.steps, (self.counted_mm, self.index_mm))
            frame = Position(moment_ms, steps, way_mm, speed, state, index)
            self.phase.note(frame, self.now_s + delay_s)

    def steps(self, way_mm):
        """Return the board's half-steps for a way."""
        return None if way_mm is None else self.sign * round(way_mm * HALF_STEPS_PER_MM)

    def off_mm(self):
        """Return the error of the phase against the cams, modulo a wavelength."""
        (wave_mm,) = self.phase.at(np.array([self.now_s + 0.01]))
        return (wave_mm - (self.cam_mm - self.origin_mm) + 40) % WAVELENGTH_MM - 40


@pytest.mark.parametrize("sign", [1, -1])
def test_the_way_is_that_of_the_cams_at_any_moment(sign):
    board = Board(sign=sign)
    board.run(0.4, state="stopped")
    board.run(10.0)
    moments_s = board.now_s + 0.01 - np.array([5.0, 2.03, 0.5, 0.1, 0.0, -0.3])
    expected_mm = board.cam_mm - 3.0 - SPEED_MM_S * (board.now_s + 0.01 - moments_s)
    np.testing.assert_allclose(board.phase.at(moments_s), expected_mm, atol=0.1)


def test_where_nobody_knows_it_is_nan():
    board = Board()
    assert np.isnan(board.phase.at(np.array([1.0]))).all()
    board.run(4.0)
    silent_from_s = board.now_s
    board.now_s += 3.0
    board.run(4.0)
    moments_s = np.array([silent_from_s - 1, silent_from_s + 1.5, board.now_s, board.now_s + 2])
    assert np.isnan(board.phase.at(moments_s)).tolist() == [False, True, False, True]
    board.run(1.0, state="stopped")
    assert not board.phase.known


@given(
    sign=st.sampled_from([1, -1]),
    cam_mm=st.floats(0, 80),
    indexed=st.booleans(),
    before_s=st.floats(7, 20),
    mishaps=st.lists(st.tuples(st.booleans(), st.floats(7, 20), st.floats(0, 0.05)), max_size=3),
)
def test_after_resets_and_lost_steps_the_index_tells_the_same_phase_and_else_nobody_does(
    sign, cam_mm, indexed, before_s, mishaps
):
    board = Board(sign=sign, cam_mm=cam_mm, indexed=indexed)
    board.run(before_s)
    assert board.off_mm() == pytest.approx(0.0, abs=0.3)
    for resets, runs_s, delay_s in mishaps:
        if resets or not indexed:
            board.now_s += 1.0
            board.reset()
            board.run(0.2, state="stopped")
        else:
            board.run(5.0, stalled=True)
        assert not board.phase.known
        board.run(runs_s, delay_s=delay_s)
        assert board.phase.known == indexed
        assert not indexed or board.off_mm() == pytest.approx(0.0, abs=0.6 + 25 * delay_s)


def test_a_reset_before_the_first_index_loses_the_phase_for_good():
    board = Board(index_at_mm=79.0, cam_mm=0.0)
    board.run(1.0)
    board.reset()
    board.run(20.0)
    assert (board.phase.index_mm, board.phase.known) == (None, False)
