"""The session that judges the shipped archive is what the documents say.

`tests/capsule/phantom` makes the recordings that teach again.
"""

from collections import Counter

from capsule.commands.cli import build_parser
from capsule.engine.configuration import read_config_file
from capsule.evaluation.confounded import confounded_keys
from capsule.phantom.files import DEFAULT_TABLE, read_phantom
from capsule.phantom.simulation import planned_runs, recording_of, simulate_run
from capsule.recordings.recording import format_recording, split_header
from support.documents import text_of
from support.project import ROOT

RAW = ROOT / "raw"


def test_the_held_out_session_is_what_the_documented_command_makes_and_twenty_a_size_teach():
    """Two of its recordings are made again, to the byte; the first lines of the others agree."""
    text = text_of("docs/phantom.md").replace("\\\n", " ")
    (command,) = (line.split() for line in text.splitlines() if "--prefix h" in line)
    asked = build_parser(["simulate"]).parse_args(command[1:])
    session = f"simulated-{asked.seed}"
    assert read_config_file(ROOT / "config/config.yaml")["evaluation"]["held_out"] == [session]
    headers = {}
    for path in RAW.glob("*/*.csv"):
        header, _ = split_header(path.read_text(encoding="utf-8").splitlines())
        headers[f"{path.parent.name}/{path.stem}"] = header
    planned = planned_runs(asked.sizes, asked.runs, asked.passes, asked.setups, asked.prefix)
    held_out = {name for name, header in headers.items() if header["session"] == session}
    assert held_out == {each.name for each in planned}
    for each in planned:
        assert headers[each.name]["site"] == f"{session}/{each.site}"
        assert headers[each.name]["setup"] == f"{session}/{each.setup}"
    assert {header["source"] for header in headers.values()} == {"simulated phantom"}
    # Kills: an archive whose headers tell the nodule.
    rows = {name: {"status": "accepted", **header} for name, header in headers.items()}
    assert confounded_keys(rows, [session]) == []
    sizes = Counter(name.partition("/")[0] for name in headers.keys() - held_out)
    assert sizes == {f"{size}mm": 20 for size in range(6)}
    phantom = read_phantom(DEFAULT_TABLE, [])
    for site, size_mm, setup in (("0mm/h60", 0, "0mm/60"), ("3mm/h03", 3, "3mm/3")):
        run = simulate_run(phantom, size_mm, asked.seed, site, setup=setup)
        made = format_recording(recording_of(run, phantom, asked.seed, site, setup=setup))
        assert made == (RAW / f"{site}.csv").read_bytes()
