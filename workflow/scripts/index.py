"""List every file under raw/: accepted, rejected or passed over, with the reason."""

import argparse
from pathlib import Path

import numpy as np

from capsule.listing import COLUMNS, NEAR_COPIES, full_list, refuse_rejected
from edges import files


def main() -> None:
    """Write recordings.csv and passed_over.csv; with --on-rejected fail, stop at a rejection."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--raw", type=Path, required=True, help="the folder of recordings")
    parser.add_argument("--checks", type=Path, required=True, help="the folder of checks")
    parser.add_argument("--signals", type=Path, required=True, help="the folder of signals")
    parser.add_argument("--on-rejected", choices=["report", "fail"], default="report")
    parser.add_argument("--output", type=Path, required=True, help="output: recordings.csv")
    parser.add_argument("--passed-over", type=Path, required=True, help="output: the other files")
    arguments = parser.parse_args()
    archive = files.list_archive(arguments.raw)
    paths = {name: arguments.checks / f"{name}.json" for name in archive.recordings}
    for name in [name for name, path in paths.items() if not path.exists()]:
        print(f"{name}: added while the workflow ran; run the workflow again to include it")
        del paths[name]
    checks = {name: files.read_json(path) for name, path in paths.items()}
    rows = full_list(archive, checks, lambda name: np.load(arguments.signals / f"{name}.npy"))
    rejected = [row for row in rows if row["status"] != "accepted"]
    print(f"{len(rows) - len(rejected)} recordings accepted, {len(rejected)} rejected")
    if arguments.on_rejected == "fail":
        refuse_rejected(rows)
    print("\n".join(f"{row['recording']}: {row['reason']}" for row in rejected))
    for row in rows:
        if row[NEAR_COPIES]:
            print(f"{row['recording']}: nearly the same as {row[NEAR_COPIES].replace(' ', ', ')}")
    others = archive.passed_over.items()
    passed_over = [{"path": path, "reason": reason} for path, reason in others]
    files.write_csv(arguments.passed_over, ["path", "reason"], passed_over)
    files.write_csv(arguments.output, [*COLUMNS, NEAR_COPIES], rows)


if __name__ == "__main__":
    files.run(main)
