"""The session that judges the shipped archive is what the documents say.

`tests/capsule/phantom` makes the recordings that teach again.
"""

import argparse

from capsule.engine.configuration import read_config_file
from capsule.phantom.files import DEFAULT_TABLE, read_phantom
from capsule.phantom.simulation import planned_runs, recording_of, simulate_run
from capsule.recordings.recording import format_recording, read_recording
from support.project import ROOT

RAW = ROOT / "raw"


def test_the_held_out_session_is_what_the_documented_command_makes(tmp_path):
    """Two of its recordings are made again, to the byte; the first lines of the others agree."""
    text = (ROOT / "docs/phantom.md").read_text(encoding="utf-8").replace("\\\n", " ")
    (command,) = (line.split() for line in text.splitlines() if "--prefix h" in line)
    parser = argparse.ArgumentParser()
    for option in ("--sizes", "--runs", "--setups"):
        parser.add_argument(option, nargs="+", type=int, default=[*range(6)])
    options, others = parser.parse_known_args(command)
    assert read_config_file(ROOT / "config/config.yaml")["evaluation"]["held_out"] == [
        f"simulated-{others[others.index('--seed') + 1]}"
    ]
    for planned in planned_runs(options.sizes, options.runs, 1, options.setups, "h"):
        with (RAW / f"{planned.name}.csv").open("rb") as stream:
            recording = read_recording(stream, sensors=4)
        archive = recording.header["session"]
        assert recording.header["site"] == f"{archive}/{planned.site}"
        assert recording.header["setup"] == f"{archive}/{planned.setup}"
    phantom = read_phantom(DEFAULT_TABLE, [])
    seed = int(archive.rpartition("-")[2])
    for site, size_mm, setup in (("0mm/h60", 0, "0mm/60"), ("3mm/h03", 3, "3mm/3")):
        run = simulate_run(phantom, size_mm, seed, site, setup=setup)
        made = format_recording(recording_of(run, phantom, seed, site, setup=setup))
        assert made == (RAW / f"{site}.csv").read_bytes()


def test_twenty_recordings_of_each_size_teach_and_a_session_of_its_own_judges():
    held_out = read_config_file(ROOT / "config/config.yaml")["evaluation"]["held_out"]
    for size in range(6):
        headers = []
        for path in (RAW / f"{size}mm").glob("*.csv"):
            with path.open("rb") as stream:
                headers.append(read_recording(stream, sensors=4).header)
        assert {header["source"] for header in headers} == {"simulated phantom"}
        teaching = [header for header in headers if header["session"] not in held_out]
        judging = [header for header in headers if header["session"] in held_out]
        assert (len(teaching), len(judging)) == (20, 20 if size else 60)
        setups = [{header["setup"] for header in each} for each in (teaching, judging)]
        assert len(setups[1]) >= 3 and not setups[0] & setups[1]
        assert len({header["site"] for header in headers}) == len(headers)
