"""capsule record and capsule survey on the real firmware in the emulator, with what a lab fears."""

import json
import os
import signal

import numpy as np
import pytest

from capsule.bench.clock import AWAKE
from support.bench import emulated
from support.bench.recorder import Recorder
from support.bench.rig import Killed, Rig
from support.bench.workbench import STRETCH_S, Clock, TerminalCable, Workbench

pytestmark = [pytest.mark.boards, pytest.mark.takes, emulated.needed]

# The lease, and the ramp from 25 mm/s at 25 mm/s^2.
LEASE_AND_RAMP_S = 5 + 1
# A call that never returns, which no signal ends: Python runs no handler meanwhile.
DEAD_DISK = """
import ctypes, os

fsync, libc, mutex = os.fsync, ctypes.CDLL(None), ctypes.create_string_buffer(256)
def hang(descriptor):
    for _ in range(2 if os.path.exists({dead!r}) else 0):
        libc.pthread_mutex_lock(mutex)
    fsync(descriptor)
os.fsync = hang
"""


def test_a_disk_that_hangs_lets_no_wave_run_on_and_its_samples_are_recovered(tmp_path):
    logger, motor = map(emulated.EmulatedBoard, (emulated.LOGGER, emulated.PERISTALSIS))
    cable, wave_cable = (
        TerminalCable(board, tmp_path / name) for board, name in ((logger, "A"), (motor, "B"))
    )
    # A bench so much faster than the clock still gets a question in each of its seconds.
    bench = Workbench(wave_cable, cable, world=Clock(logger), speed=4)
    words = ("--port", cable.port, "--drive", wave_cable.port, "--size", "3", "--name", "r01")
    dead = tmp_path / "dead"
    (tmp_path / "sitecustomize.py").write_text(DEAD_DISK.format(dead=str(dead)))
    recorder = Recorder(tmp_path, *words, env=os.environ | {"PYTHONPATH": str(tmp_path)})
    bench.run(lambda: cable.samples >= 150)
    recorder.wait_for_samples(100)  # on disk while it records
    bench.speed = 1
    dead.touch()
    bench.run_for(0.5)
    recorder.process.send_signal(signal.SIGINT)
    hung_s = bench.now_s
    bench.run(lambda: motor.coils == 0)
    assert bench.now_s - hung_s < LEASE_AND_RAMP_S
    assert not recorder.done()
    # The second Ctrl-C ends it at once, as a kill does.
    recorder.process.send_signal(signal.SIGINT)
    bench.run(recorder.done)
    recorder.expect(130, "ended at once by a second Ctrl-C")
    bench.speed, standing = None, motor.half_steps
    bench.run_for(LEASE_AND_RAMP_S)
    assert (motor.coils, motor.half_steps) == (0, standing)
    (part,) = recorder.parts()
    with part.open("ab") as stream:
        stream.write(b"99.9,1,2")  # as a power cut leaves it
    Recorder(tmp_path, *words).expect(10, "capsule record --recover")
    recover = Recorder(tmp_path, "--recover")
    recover.expect(0, "recovered", "8 bytes at its end left out: not a whole line")
    recording = recorder.recording()
    assert recording.time_s.size >= 100
    # Each row holds the sample of its time.
    np.testing.assert_allclose(np.diff(recording.time_s), 0.1, atol=1e-9)
    told, complement = recording.values[:2], recording.values[2:]
    np.testing.assert_array_equal(told, 1023 - complement)
    taken_s = np.array([1024, 1]) @ told * STRETCH_S
    assert np.ptp(taken_s - recording.time_s) <= 0.012
    Recorder(tmp_path, "--recover").expect(0, "nothing to recover")
    assert not cable.boot_loader_stuck, "the boot loader heard a byte"


# The first target is reached as soon as the wave is felt; then it folds to go back.
THERE_AND_BACK = ("--goto", 11, 3)
PORTS = ("--drive", "wave", "--fold", "fold", "--port", "logger", "--out", "tuesday")


@pytest.fixture
def rig(tmp_path):
    """Return a bench with the real firmware of the boards with motors."""
    with pytest.MonkeyPatch.context() as replaced:
        yield Rig(tmp_path, replaced)
    AWAKE.__init__()


def test_a_link_may_be_lost_and_a_computer_die_and_the_next_one_goes_on(rig, capsys):
    pulled_s, found_mm = [], []

    def unplug():
        rig.cables.fold.unplug()
        pulled_s.append(rig.bench.now_s)

    def is_in(state):
        return lambda: rig.events()[-1]["after"] == state

    acts = [
        (lambda: rig.origami.folded == 1.0, lambda: None),
        (is_in("returning"), unplug),
        (lambda: rig.bench.now_s > pulled_s[0] + 6, rig.cables.fold.plug),
        (is_in("finding"), lambda: None),
        (is_in("returning"), rig.kill),
    ]
    with pytest.raises(Killed):
        rig.survey(*PORTS, *THERE_AND_BACK, then=acts)
    assert "was unplugged" in capsys.readouterr().out
    assert "let_go" in [event["event"] for event in rig.events()]
    # A lost link costs time alone.
    times_s = [float(row[0]) for row in rig.stream()]
    assert times_s == pytest.approx([number / 10 for number in range(len(times_s))])
    # The wave's way is that of the cams, whatever the lines' delays.
    wave_mm = np.array([float(row[5]) for row in rig.stream()[20:-20]])
    np.testing.assert_allclose(np.diff(wave_mm), 2.5, atol=0.3)
    about = json.loads((rig.folder / "session.json").read_text())
    assert about["index_mm"] is not None
    assert about["header"]["source"] == "recorded by the logger board, firmware 1.1"
    assert about["header"]["wave_speed_mm_s"] == "25"
    before = (rig.folder / "stream.csv.part").read_bytes()
    rig.rest(4)
    assert rig.origami.folded == 1.0
    rig.rest(8)  # the lease of 5 s and a move of 5 s
    assert rig.at_rest()

    # Opening the ports resets the boards; the index tells where the cams are.
    def is_found():
        return "mm from the goal" in rig.events()[-1]["reason"]

    def look():
        found_mm.append(rig.gut.head_mm)
        rig.stop.reason = "Ctrl-C"

    with pytest.raises(KeyboardInterrupt):
        rig.survey("--resume", "tuesday", then=[(is_found, look)])
    assert rig.at_rest()
    assert rig.events()[-1]["after"] == "ended"
    assert len({len(row) for row in rig.stream()}) == 1
    assert not list(rig.folder.glob("*.part"))
    found = [event for event in rig.events() if "from the goal" in event["reason"]]
    assert found[-1]["position_mm"] == pytest.approx(found_mm[0], abs=4)
    # What was there stays; the time in which nobody looked is a jump, and no row.
    assert (rig.folder / "stream.csv").read_bytes().startswith(before[:-700])
    times_s = [float(row[0]) for row in rig.stream()]
    assert np.count_nonzero(np.diff(times_s) > 0.15) == 1
    # Kills: events by the pilot's clock, which does not count that time.
    assert rig.events()[-1]["time_s"] == pytest.approx(times_s[-1], abs=1)
    assert not rig.cables.logger.boot_loader_stuck
