"""A killed survey on boards: its files are read, and it continues where the capsule is."""

import json
import shutil

import numpy as np
import pytest

from capsule.phantom.journey import Nodule
from support.bench.rig import needed

pytestmark = [pytest.mark.boards, needed]
AT_MM = 45.0
THERE_AND_BACK = "--goto", 25, 12


def killed_when(bench, until, *options):
    """Start a survey, kill it when a condition holds, and wait for some time."""
    surveyor = bench.survey(*options)
    surveyor.run(until)
    surveyor.kill()
    bench.pass_by(30)


def returning(bench):
    """Return a function that returns whether the capsule has been pushed back for some time."""
    folded_mm = []

    def is_returning():
        if bench.fold.folded == 1.0:
            folded_mm.append(bench.gut.head_mm)
        return bool(folded_mm) and bench.gut.head_mm < folded_mm[0] - 4

    return is_returning


def stream_bytes(bench):
    return (bench.folder / "tuesday" / "stream.csv.part").read_bytes()


def test_killed_while_folded_it_unfolds_by_itself_and_is_taken_up(rig):
    bench = rig()
    killed_when(bench, returning(bench), *THERE_AND_BACK)
    # Nobody renews the leases: the origami unfolds and the wave stops without any computer.
    assert bench.at_rest()
    before = stream_bytes(bench)
    bench.resume().expect(0, "finding the position")
    assert bench.at_rest()
    assert bench.gut.head_mm == pytest.approx(12.0, abs=5)
    # What was there stays; the time in which nobody looked is a jump, and no row.
    after = (bench.folder / "tuesday" / "stream.csv").read_bytes()
    assert after.startswith(before)
    steps_s = np.diff([float(row[0]) for row in bench.stream()])
    jumps_s = steps_s[steps_s > 0.15]
    assert jumps_s.size == 1
    assert 30 < jumps_s[0] < 45
    names = [event["event"] for event in bench.events()]
    assert "let_go" in names
    assert names[-1] == "tick"


def test_after_a_power_cut_a_place_is_still_judged(rig):
    bench = rig(nodules=[Nodule(AT_MM, 3.0)])
    killed_when(bench, returning(bench))
    # All lose their supply, and the disk loses what it had not kept.
    for cable in vars(bench.cables).values():
        cable.unplug()
    session = bench.folder / "tuesday"
    for name, lost in (("stream.csv.part", 345), ("events.jsonl.part", 30)):
        part = session / name
        part.write_bytes(part.read_bytes()[:-lost])
    bench.pass_by(60)
    for cable in vars(bench.cables).values():
        cable.plug()
    bench.resume().expect(0, "1 confirmed")
    assert bench.at_rest()
    (place,) = [place for place in bench.places() if place["status"] == "confirmed"]
    assert float(place["place_mm"]) == pytest.approx(AT_MM, abs=5)


def test_a_session_whose_events_would_differ_is_left_as_it_is(rig):
    bench = rig()
    killed_when(bench, returning(bench), *THERE_AND_BACK)
    folder = bench.folder / "other"
    shutil.copytree(bench.folder / "tuesday", folder)
    events = (folder / "events.jsonl.part").read_text()
    (folder / "events.jsonl.part").write_text(events.replace('"folding"', '"unfolding"'))
    bench.resume(session="other").expect(1, "differs in the resumed session")
    assert (folder / "stream.csv.part").exists()
    assert bench.at_rest()


def test_without_an_index_switch_it_cannot_go_on_and_says_so(rig):
    bench = rig(indexed=False)
    killed_when(bench, lambda: bench.gut.head_mm > 10, *THERE_AND_BACK)
    bench.resume("--patience", 15).expect(11, "has no index switch")
    assert bench.at_rest()
    assert not list((bench.folder / "tuesday").glob("*.part"))


def test_killed_while_it_was_ending_it_ends(rig):
    bench = rig()
    surveyor = bench.survey(*THERE_AND_BACK)
    surveyor.run(returning(bench))
    surveyor.send_signal()
    surveyor.run(lambda: bench.fold.said[-1] == "unfolding")
    bench.pass_by(1)
    surveyor.run(lambda: "stopped" in events_so_far(bench))
    surveyor.kill()
    bench.pass_by(30)
    bench.resume().expect(130)
    assert bench.at_rest()
    assert bench.events()[-1]["after"] == "ended"
    assert [event["event"] for event in bench.events()].count("stopped") == 1


def events_so_far(bench):
    lines = (bench.folder / "tuesday" / "events.jsonl.part").read_text().splitlines()
    return [json.loads(line)["event"] for line in lines]


def test_a_board_that_has_another_port_now_is_named_when_resuming(rig):
    bench = rig()
    killed_when(bench, lambda: bench.gut.head_mm > 10, "--goto", 15)
    link = bench.folder / "moved"
    bench.cables.fold.link.rename(link)
    bench.cables.fold.link = link
    bench.resume().expect(3, "there is no port")
    bench.resume("--fold", link).expect(0)
    assert bench.at_rest()
