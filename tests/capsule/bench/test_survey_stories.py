"""capsule survey on the real firmware in the emulator: what moves stops, and it ends unfolded."""

import json

import numpy as np
import pytest

from capsule.bench.clock import AWAKE
from support.bench import emulated
from support.bench.rig import Killed, Rig

pytestmark = [pytest.mark.boards, emulated.needed]
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
