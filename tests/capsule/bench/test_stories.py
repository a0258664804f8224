"""capsule record and capsule survey on the real firmware in the emulator, with what a lab fears."""

from pathlib import Path

import numpy as np
import pytest

from capsule.bench.clock import AWAKE
from capsule.bench.recorder import recover
from capsule.interface.archive import read_recording
from support.bench import emulated
from support.bench.rig import ONWARD, WAVELENGTH_MM, Killed, Rig
from support.command import parsers

pytestmark = [pytest.mark.boards, pytest.mark.takes, emulated.needed]


@pytest.fixture
def rig(tmp_path):
    """Return a bench with the real firmware of the boards with motors."""
    with pytest.MonkeyPatch.context() as replaced:
        yield Rig(tmp_path, replaced)
    AWAKE.__init__()


def pulled(rig, cable, when, for_s):
    """Return what unplugs a cable at a condition, and plugs it in so many seconds later."""
    pulled_s = []
    unplug = when, lambda: (cable.unplug(), pulled_s.append(rig.now_s))
    return [unplug, (lambda: rig.now_s > pulled_s[0] + for_s, cable.plug)]


def test_a_recording_outlives_its_loggers_cable_and_is_recovered_after_a_kill(rig, capsys):
    acts = pulled(rig, rig.cables.logger, lambda: rig.now_s > 18, for_s=3)
    acts += [(lambda: rig.now_s > 40, rig.kill)]
    with pytest.raises(Killed):
        rig.run("record --port logger --drive wave --size 3 --name r01", acts)
    rig.rest(4)  # with the next two seconds, the lease of 5 s and the ramp
    assert rig.at_rest()
    for said in ("recovered raw/3mm/r01.csv", "nothing to recover"):
        recover(parsers()["record"].parse_args(["--recover"]))
        assert said in capsys.readouterr().out
    recording = read_recording(Path("raw/3mm/r01.csv"), 4)
    assert recording.header["wave_until_s"].strip() == "end"
    np.testing.assert_allclose(np.diff(recording.time_s), 0.1, atol=1e-9)
    # Each row holds the sample of its time, also those after the gap.
    readings = recording.values[0, 30:] - np.nanmean(recording.values[0])
    turn = np.exp(2j * np.pi * 25.0 * (1 - ONWARD) / WAVELENGTH_MM * recording.time_s[30:])
    gap = np.flatnonzero(np.isnan(readings))
    assert np.ptp(gap) + 1 == gap.size > 30
    before, after = np.sum((readings * turn)[: gap[0]]), np.sum((readings * turn)[gap[-1] + 1 :])
    assert np.angle(after / before) == pytest.approx(0.0, abs=0.1)  # 0.05 s
    assert not rig.cables.logger.boot_loader_heard


def test_a_link_may_be_lost_and_a_computer_die_and_the_next_one_goes_on(rig, capsys):
    # The first target is reached as soon as the wave is felt; then it folds to go back.
    line, found_mm = "survey --drive wave --fold fold --port logger --out tuesday --goto 11 3", []

    def is_in(state):
        return lambda: rig.events()[-1]["after"] == state

    acts = [
        (lambda: rig.origami.folded == 1.0, lambda: None),
        *pulled(rig, rig.cables.fold, is_in("returning"), 6),
        (is_in("finding"), lambda: None),
        (is_in("returning"), rig.kill),
    ]
    with pytest.raises(Killed):
        rig.run(line, acts)
    assert "was unplugged" in capsys.readouterr().out
    assert "let_go" in [event["event"] for event in rig.events()]
    # A lost link costs time alone.
    times_s = [float(row[0]) for row in rig.stream()]
    assert times_s == pytest.approx([number / 10 for number in range(len(times_s))])
    # The wave's way is that of the cams, whatever the lines' delays.
    wave_mm = np.array([float(row[5]) for row in rig.stream()[20:-20]])
    np.testing.assert_allclose(np.diff(wave_mm), 2.5, atol=0.3)
    before = (rig.folder / "stream.csv.part").read_bytes()
    rig.rest(4)
    assert rig.origami.folded == 1.0
    rig.rest(8)  # the lease of 5 s and a move of 5 s
    assert rig.at_rest()

    # Opening the ports resets the boards; the index tells where the cams are.
    def is_found():
        return "mm from the goal" in rig.events()[-1]["reason"]

    acts = [(is_found, lambda: found_mm.append(rig.gut.head_mm))]
    acts += [(lambda: True, lambda: vars(rig.stop).update(reason="Ctrl-C"))]
    with pytest.raises(KeyboardInterrupt):
        rig.run("survey --resume tuesday", acts)
    assert rig.at_rest()
    assert rig.events()[-1]["after"] == "ended" and not list(rig.folder.glob("*.part"))
    found = [event for event in rig.events() if "from the goal" in event["reason"]]
    assert found[-1]["position_mm"] == pytest.approx(found_mm[0], abs=4)
    # What was there stays; the time in which nobody looked is a jump, and no row.
    assert (rig.folder / "stream.csv").read_bytes().startswith(before[:-700])
    times_s = [float(row[0]) for row in rig.stream()]
    assert np.count_nonzero(np.diff(times_s) > 0.15) == 1
    # Kills: events by the pilot's clock, which does not count that time.
    assert rig.events()[-1]["time_s"] == pytest.approx(times_s[-1], abs=1)
    assert not rig.cables.logger.boot_loader_heard
