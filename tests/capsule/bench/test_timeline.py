"""Places of samples: gaps become missing samples, and later samples keep their times."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from capsule.bench.protocol import Sample
from capsule.bench.timeline import BoardClock, Timeline


def sample(sequence, device_ms):
    return Sample(sequence, device_ms, (1, 2, 3, 4), at_end=False)


class Kept(Timeline):
    """A timeline of 10 Hz that keeps what it accepts and what it refuses."""

    def __init__(self):
        super().__init__(10, self.keep, lambda sample, reason: self.refused.append(sample))
        self.refused, self.missing, self.gaps_by_computer_clock = [], [], []

    def keep(self, sample, missing, by_computer_clock):
        """Keep the number of missing samples before a sample."""
        self.missing.append(missing)
        if by_computer_clock:
            self.gaps_by_computer_clock.append(missing)

    def take(self, sample, moment_s):
        """Accept a sample, after which none follows for a while."""
        self.sift(sample, moment_s)
        self.settle()


@pytest.mark.parametrize(
    "strange",
    [sample(5, 600), sample(4, 500), sample(9, 700), sample(6, 670), sample(0, 100)],
    ids=["again", "earlier", "more numbers than time", "off the grid", "restart unannounced"],
)
def test_a_sample_that_contradicts_the_last_is_not_used(strange):
    timeline = Kept()
    timeline.take(sample(0, 100), 1.0)
    timeline.take(sample(5, 600), 1.5)
    timeline.sift(strange, 1.6)
    timeline.sift(sample(6, 700), 1.6)
    timeline.sift(sample(7, 800), 1.7)
    assert timeline.refused == [strange]
    assert timeline.missing == [0, 4, 0, 0]


def test_after_a_restart_the_computers_clock_counts():
    timeline = Kept()
    for number in range(20):
        # The line delays by 5 ms, now and then by more: the least delay tells the time.
        delay = 0.005 + 0.06 * (number % 3 == 1)
        timeline.take(sample(number, 100 + 100 * number), 50.0 + 0.1 * number + delay)
    timeline.sift(sample(22, 2300), 50.0 + 0.1 * 22 + 0.165)  # in doubt until the restart
    assert not timeline.continues(uptime_ms=0, running=False, moment_s=55.0, fresh=False)
    timeline.note_restart()
    timeline.take(sample(0, 100), 50.0 + 0.1 * 57 + 0.005)
    timeline.take(sample(1, 200), 55.9)
    assert timeline.missing == [*(20 * [0]), 2, 34, 0]
    assert timeline.gaps_by_computer_clock == [34]


# Kills: a least delay that never ages, so that a slow clock falls behind by minutes a day.
def test_a_board_whose_clock_is_slow_is_followed():
    clock = BoardClock()
    moments_s = [clock.moment_s(100 * number, 0.1005 * number) for number in range(10_000)]
    assert moments_s[-1] == pytest.approx(0.1005 * 9_999)


def test_a_board_that_kept_running_is_told_from_one_that_restarted():
    timeline = Kept()
    timeline.take(sample(0, 50_100), 90.0)
    for fresh in (True, False):
        assert timeline.continues(uptime_ms=54_321, running=True, moment_s=94.3, fresh=fresh)
    # Up for longer than the run: what has stopped by itself has restarted.
    assert not timeline.continues(uptime_ms=59_000, running=False, moment_s=98.9, fresh=False)
    # The board's own clock counts, however late the sample arrives.
    timeline.take(sample(50, 55_100), 199.0)
    assert (timeline.missing, timeline.gaps_by_computer_clock) == ([0, 49], [])


@given(st.lists(st.tuples(st.integers(1, 40), st.integers(1, 40)), min_size=1, max_size=60))
def test_places_follow_the_boards_clock(steps):
    """Check that a sample's place follows from its time: the board counts no samples in a pause."""
    timeline = Kept()
    period = number = 0
    timeline.take(sample(0, 0), 0.0)
    for step, counted in steps:
        period, number = period + step, number + min(step, counted)
        timeline.take(sample(number, 100 * period), 0.1 * period)
        assert timeline.missing[-1] == step - 1
