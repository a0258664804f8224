"""survey.py whose clock is the bench's: where it waits, the bench runs on, and nobody else waits.

Started by `support.bench.surveyor` as a program that has imported everything, and forks for each
survey, so that a survey can be killed. It asks its parent to let the bench run for as long as it
would wait, over a pair of pipes.
"""

import json
import os
import socket
import struct
import sys
import time
from datetime import UTC, datetime, timedelta
from pathlib import Path

ASK, ANSWER, ENDED = struct.Struct("dQ"), struct.Struct("d"), struct.Struct("i")
# How often the boards are looked at; more often only takes longer.
LOOK_EVERY_S = 0.2


class BenchClock:
    """The bench's time, in place of this computer's."""

    def __init__(self, ask: int, answer: int) -> None:
        self._ask, self._answer = ask, answer
        self.sent = 0
        self.rest(0.0)

    def rest(self, seconds: float) -> None:
        """Let the bench run."""
        os.write(self._ask, ASK.pack(seconds, self.sent))
        (self.now_s,) = ANSWER.unpack(os.read(self._answer, ANSWER.size))


def survey_by(clock: BenchClock) -> None:
    """Run survey.py by a bench's clock."""
    time.monotonic = lambda: clock.now_s
    time.clock_gettime = lambda _: clock.now_s
    time.sleep = clock.rest

    class BenchDatetime(datetime):
        """Dates by the bench's clock."""

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
    survey_run.datetime = surveys.datetime = BenchDatetime
    board_bench.LOOK_EVERY_S = fold_board.LOOK_EVERY_S = LOOK_EVERY_S
    files.run(survey.main)


def serve(connection: socket.socket) -> None:
    """Fork for each survey that is wanted; tell its process, and at its end its exit status."""
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
            sys.argv = ["survey.py", *call["arguments"]]
            survey_by(BenchClock(ask, answer))
            sys.exit()
        for handle in handles:
            os.close(handle)
        connection.sendall(ENDED.pack(process))
        status = os.waitpid(process, 0)[1]
        connection.sendall(ENDED.pack(os.waitstatus_to_exitcode(status)))


if __name__ == "__main__":
    sys.path.insert(0, str(Path(__file__).parents[3] / "workflow" / "scripts"))
    import survey
    from acquisition import board_bench, fold_board, survey_run, surveys
    from acquisition.clock import AWAKE
    from acquisition.line import Line
    from acquisition.protocol import encode
    from edges import files

    with socket.socket(fileno=int(sys.argv[1])) as served:
        serve(served)
