"""Run capsule survey with the bench's clock: instead of waiting, it lets the bench run.

`support.bench.surveyor` starts this program. It imports everything once and forks for each survey,
so that a test can kill a survey. Through a pair of pipes, a survey asks its parent to run the bench
for the time that it would wait.
"""

import json
import math
import os
import socket
import struct
import sys
import time
from datetime import UTC, datetime, timedelta
from pathlib import Path

ASK, ANSWER, ENDED = struct.Struct("dQ"), struct.Struct("d"), struct.Struct("i")
# Interval at which the boards are read; a shorter one only takes longer.
LOOK_EVERY_S = 0.2


class BenchClock:
    """A clock with the bench's time, in place of the computer's."""

    def __init__(self, ask: int, answer: int) -> None:
        self._ask, self._answer = ask, answer
        self.sent = 0
        self.rest(0.0)

    def rest(self, seconds: float) -> None:
        """Run the bench for this time."""
        os.write(self._ask, ASK.pack(seconds, self.sent))
        (self.now_s,) = ANSWER.unpack(os.read(self._answer, ANSWER.size))


def survey_by(clock: BenchClock, arguments: list[str]) -> None:
    """Run capsule survey by a bench's clock."""
    time.monotonic = lambda: clock.now_s
    time.clock_gettime = lambda _: clock.now_s
    time.sleep = clock.rest

    class BenchDatetime(datetime):
        """A datetime with the bench's clock."""

        @classmethod
        def now(cls, tz: object = None) -> datetime:
            del tz
            return datetime(2026, 1, 1, tzinfo=UTC) + timedelta(seconds=clock.now_s)

    receive, send = Line.receive, Line.send

    def patient_receive(line: Line, timeout_s: float = LOOK_EVERY_S) -> list:
        arrivals = receive(line, 0)
        if arrivals or not timeout_s:
            return arrivals
        clock.rest(timeout_s)
        return receive(line, 0)

    def counted_send(line: Line, payload: str) -> None:
        send(line, payload)
        clock.sent += len(encode(payload))

    Line.receive, Line.send = patient_receive, counted_send
    AWAKE.__init__()
    survey_run.datetime = survey_command.datetime = BenchDatetime
    wave.HANGS_AFTER_S = math.inf  # the main thread waits for the bench, by the computer's clock
    survey_bench.LOOK_EVERY_S = fold.READ_TIMEOUT_S = LOOK_EVERY_S
    cli.main(["survey", *arguments])


def serve(connection: socket.socket) -> None:
    """Fork for each survey; send its process number, and its exit status when it ends."""
    while True:
        content, handles, _, _ = socket.recv_fds(connection, 2**16, 4)
        if not content:
            return
        call = json.loads(content)
        process = os.fork()
        if process == 0:
            connection.close()
            ask, answer, printed, errors = handles
            os.dup2(printed, 1)
            os.dup2(errors, 2)
            os.chdir(call["folder"])
            survey_by(BenchClock(ask, answer), call["arguments"])
            sys.exit()
        for handle in handles:
            os.close(handle)
        connection.sendall(ENDED.pack(process))
        status = os.waitpid(process, 0)[1]
        connection.sendall(ENDED.pack(os.waitstatus_to_exitcode(status)))


if __name__ == "__main__":
    sys.path.insert(0, str(Path(__file__).parents[3] / "workflow" / "scripts"))
    from capsule.bench import fold, survey_bench, survey_command, survey_run, wave
    from capsule.bench.clock import AWAKE
    from capsule.bench.line import Line
    from capsule.bench.protocol import encode
    from capsule.commands import cli

    with socket.socket(fileno=int(sys.argv[1])) as served:
        serve(served)
