"""A recording against whatever the line may say, on a written script: what arrives is kept."""

import pytest

from acquisition.bench_errors import BoardLostError
from acquisition.protocol import encode
from support.bench.scripted import ScriptedBench, sample_frame


def samples(first, last):
    """Give the samples of these numbers, each when it was taken."""
    return [(number / 10, sample_frame(number)) for number in range(first, last)]


@pytest.fixture
def bench(tmp_path, monkeypatch):
    return ScriptedBench(tmp_path, monkeypatch)


def test_after_a_stop_what_lies_in_the_port_is_read_first(bench):
    unread = b"".join(sample_frame(number) for number in range(30, 110))
    bench.run([*samples(0, 30), (11.0, unread), *samples(110, 130)])
    assert bench.numbers() == list(range(130))
    assert bench.session.progress.missing == 0


def test_the_time_in_which_the_recorder_was_stopped_is_no_silence(bench):
    # Nothing lay in the port: the board was lost meanwhile, and may still come back.
    bench.run([*samples(0, 30), (11.0, b""), (11.1, b""), *samples(112, 120)])
    assert bench.numbers() == [*range(30), *range(112, 120)]


@pytest.mark.parametrize(
    "nonsense",
    [b"\xff\x00 static\n", encode("P,100,2,3.0,4.0,running") + encode("A,pause")],
    ids=["garbage", "another board"],
)
def test_nonsense_for_ever_ends_by_patience(bench, nonsense):
    script = [*samples(0, 30), *((3 + tick / 10, nonsense) for tick in range(600))]
    with pytest.raises(BoardLostError, match=r"sent no sample for 5 s \(--patience\)"):
        bench.run(script)
    assert bench.now_s < 9
    assert bench.numbers() == list(range(30))


def test_nonsense_for_ever_ends_by_duration(tmp_path, monkeypatch):
    bench = ScriptedBench(tmp_path, monkeypatch, duration=60, patience_s=1000)
    script = [*samples(0, 30), *((3 + tick / 10, b"static\n") for tick in range(600))]
    with pytest.raises(BoardLostError, match="--duration is over"):
        bench.run(script)
    assert bench.now_s < 7
    assert bench.numbers() == list(range(30))


def test_a_duration_that_passes_while_the_recorder_is_stopped_is_filled_from_the_port(
    tmp_path, monkeypatch
):
    bench = ScriptedBench(tmp_path, monkeypatch, duration=60)
    unread = b"".join(sample_frame(number) for number in range(30, 80))
    bench.run([*samples(0, 30), (20.0, unread)])
    assert bench.numbers() == list(range(60))
    assert bench.session.ended == "--duration is over"
