"""List every file under raw/: what was accepted, what was not, and why."""

import argparse
from pathlib import Path

import numpy as np

from capsule.errors import CapsuleError
from capsule.listing import COLUMNS, list_rows
from capsule.naming import sort_key
from capsule.near_copies import near_copies
from edges import files


def main() -> None:
    """Write recordings.csv and passed_over.csv; with --on-rejected fail, stop on a rejected one."""
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
    rows = list(list_rows(archive, checks))
    accepted = [row["recording"] for row in rows if row["status"] == "accepted"]
    # By content: which pairs are compared, and which way round, does not depend on names.
    accepted.sort(key=lambda name: checks[name]["readings_sha256"])
    alike = near_copies(accepted, lambda name: np.load(arguments.signals / f"{name}.npy"))
    alike = {name: sorted(alike[name], key=sort_key) for name in sorted(alike, key=sort_key)}
    for row in rows:
        row["near_copies"] = " ".join(alike.get(row["recording"], []))
    refused = [row for row in rows if row["status"] != "accepted"]
    rejected = [f"{row['recording']}: {row['reason']}" for row in refused]
    print(f"{len(rows) - len(rejected)} recordings accepted, {len(rejected)} rejected")
    if rejected and arguments.on_rejected == "fail":
        lines = "".join(f"\n  {line}" for line in rejected)
        raise CapsuleError(
            f"on_rejected is fail, and these recordings are rejected:{lines}\n"
            "repair or remove them, or set on_rejected: report in config/config.yaml"
        )
    print("\n".join(rejected))
    print("".join(f"{name}: nearly the same as {', '.join(alike[name])}\n" for name in alike))
    others = archive.passed_over.items()
    passed_over = [{"path": path, "reason": reason} for path, reason in others]
    files.write_csv(arguments.passed_over, ["path", "reason"], passed_over)
    files.write_csv(arguments.output, [*COLUMNS, "near_copies"], rows)


if __name__ == "__main__":
    files.run(main)
