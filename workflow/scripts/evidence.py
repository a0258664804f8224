"""Collect what the report draws of every usable recording of a set, whatever the others are."""

import argparse
from pathlib import Path

from capsule.page.packing import deflated, to_json
from capsule.page.quality import quality_words
from capsule.page.recording_evidence import RecordingResults, recording_evidence
from edges import files
from edges.evidence_files import StoredEvidence, write_evidence
from edges.fits import read_fit
from edges.scorer_files import read_stretches
from edges.search_signals import search_arguments, usable_signals


def main() -> None:
    """Read the signals, checks, fits and stretches, and write what the report draws."""
    parser = argparse.ArgumentParser(description=__doc__, parents=[search_arguments()])
    parser.add_argument("--checks", type=Path, required=True, help="the folder of checks")
    parser.add_argument("--fits", type=Path, required=True, help="the folder of fits")
    parser.add_argument("--stretches", type=Path, nargs="*", default=[], help="stretches, .npz")
    parser.add_argument("--output", type=Path, required=True, help="output: the evidence, .json")
    arguments = parser.parse_args()
    rate_hz, evidence = arguments.rate_hz, {}
    stretches = read_stretches(arguments.stretches, arguments.recordings)
    for name, values in usable_signals(arguments.signals, arguments.recordings, "drawn"):
        check = files.read_json(arguments.checks / f"{name}.json")
        fit = read_fit(arguments.fits / f"{name}.json")
        results = RecordingResults(values, check, fit, stretches.get(name))
        drawn = recording_evidence(name, results, rate_hz, arguments.settings)
        quality = quality_words(values, check["at_ends"], rate_hz)
        evidence[name] = StoredEvidence(quality, deflated(to_json(drawn)))
    write_evidence(arguments.output, evidence)
    print(f"{len(evidence)} recordings drawn")


if __name__ == "__main__":
    files.run(main)
