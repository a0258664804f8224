"""capsule record with a line that works on every system, and output that nobody takes."""

import os
import socket
import threading

import pytest

from capsule.bench.protocol import encode
from capsule.bench.terminal import WAITING_TEXTS, PatientOutput
from support.bench.recorder import Recorder
from support.bench.scripted import identity_frame, sample_frame

ANSWERS = {
    b"start": encode("A,start") + b"".join(map(sample_frame, range(250))),
    b"pause": encode("A,pause"),
    b"identify": identity_frame(state="paused"),
}


def answer(server):
    """Answer one program as a logger does that has taken all its samples before."""
    connection, _ = server.accept()
    with connection, connection.makefile("rb") as lines:
        for line in lines:
            connection.sendall(ANSWERS[line.strip(b"$\n").partition(b"*")[0]])


@pytest.mark.boards
def test_records_into_the_archive(tmp_path):
    with socket.create_server(("127.0.0.1", 0)) as server:
        board = threading.Thread(target=answer, args=(server,))
        board.start()
        port = f"socket://127.0.0.1:{server.getsockname()[1]}"
        options = ("--unlabelled", "--duration", "20", "--name", "run-1")
        recorder = Recorder(tmp_path, "--port", port, *options)
        try:
            recorder.process.wait()  # its patience ends it
            recorder.expect(0, "200 samples", "no gap")
        finally:
            Recorder.end_all()
            board.join()
    assert recorder.recording_named("unlabelled/run-1").values[0].tolist() == list(range(200))


# Kills: a terminal that takes no output, or is closed, and holds a recording up.
@pytest.mark.parametrize("closed", [False, True])
def test_output_that_nobody_takes_holds_nothing_up(closed):
    ours, theirs = os.pipe()
    output = PatientOutput(theirs, "utf-8")
    if closed:
        os.close(ours)
    for _ in range(2 * WAITING_TEXTS):
        assert output.write(1000 * "x") == 1000
    if not closed:
        os.close(ours)
    output.finish()
    assert not output._writer.is_alive()
    os.close(theirs)
