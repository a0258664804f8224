"""Find the best candidate for a nodule in every usable recording of a set."""

import argparse
from dataclasses import asdict, fields
from pathlib import Path

from capsule.detectors.passage import UNKNOWN, Passage, passage_of
from edges import files
from edges.search_signals import search_arguments, usable_signals


def main() -> None:
    """Read the signals, and write one row for each recording."""
    parser = argparse.ArgumentParser(description=__doc__, parents=[search_arguments()])
    parser.add_argument("--output", type=Path, required=True, help="output: the table")
    arguments = parser.parse_args()
    rows = []
    for name, values in usable_signals(arguments.signals, arguments.recordings, "searched"):
        passage = passage_of(values, arguments.rate_hz, arguments.settings["diagonal"])
        if passage is UNKNOWN:
            print(f"{name}: no peristaltic wave was found on every sensor")
        rows.append({"recording": name, **asdict(passage)})
    columns = ["recording", *(field.name for field in fields(Passage))]
    files.write_csv(arguments.output, columns, rows)
    print(f"{len(rows)} recordings searched")


if __name__ == "__main__":
    files.run(main)
