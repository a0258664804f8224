"""The simulator makes exactly the recordings that ship with the project."""

import subprocess
import sys

import pytest

from capsule.recording import read_recording
from support.project import ROOT

RAW = ROOT / "raw"


@pytest.mark.parametrize("size", ["0", "3", "5"])
def test_the_simulator_makes_the_shipped_recordings_again_to_the_byte(tmp_path, size):
    with (RAW / f"{size}mm/r01.csv").open("rb") as stream:
        header = read_recording(stream, sensors=4).header
    command = [sys.executable, str(ROOT / "workflow/scripts/simulate.py"), "--out", str(tmp_path)]
    command += ["--seed", header["simulator_seed"], "--sizes", size, "--runs", "2"]
    subprocess.run(command, check=True, capture_output=True)
    for name in ("r01", "r02"):
        made = (tmp_path / f"{size}mm/{name}.csv").read_bytes()
        assert made == (RAW / f"{size}mm/{name}.csv").read_bytes()


def test_twenty_recordings_of_each_size_ship_and_say_that_they_are_simulated():
    for size in range(6):
        files = sorted((RAW / f"{size}mm").glob("*.csv"))
        assert len(files) == 20
        for file in files:
            assert "\n# source: simulated" in "\n" + file.read_text(encoding="utf-8")[:300]
