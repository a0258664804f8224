"""List every file under raw/: accepted, rejected or passed over, with the reason."""

import argparse
import json
from pathlib import Path

from capsule.engine.jobs import run
from capsule.errors import CapsuleError
from capsule.recordings.listing import COLUMNS, NEAR_COPIES, full_list, refuse_rejected
from capsule.recordings.names import Archive, sort_key
from capsule.store import files
from capsule.store.results import BATCH_COLUMNS, Results, read_checks


def main() -> None:
    """Write the list of the recordings; with on_rejected: fail, stop at a rejection."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--raw", type=Path, required=True, help="the folder of recordings")
    parser.add_argument("--results", type=Path, required=True, help="the folder of results")
    parser.add_argument("--settings", type=json.loads, required=True, help="what to list, JSON")
    parser.add_argument(
        "--output", type=Path, nargs="+", required=True, help="output: recordings, other files"
    )
    arguments = parser.parse_args()
    settings, raw = arguments.settings, arguments.raw
    batches, checks = read_checks(arguments.results, settings["described"])
    recordings, archive = tuple(sorted(checks, key=sort_key)), Archive((), {}, {})
    if settings["others"]:
        archive = files.list_archive(raw)
        if archive.others() != settings["others"]:
            raise CapsuleError(f"{raw}/ has changed since the run began; run the command again")
    archive = Archive(recordings, archive.refused, archive.passed_over)
    rows = full_list(archive, checks, Results(arguments.results, batches).signal)
    rejected = [row for row in rows if row["status"] != "accepted"]
    print(f"{len(rows) - len(rejected)} recordings accepted, {len(rejected)} rejected")
    if settings["on_rejected"] == "fail":
        refuse_rejected(rows)
    print("\n".join(f"{row['recording']}: {row['reason']}" for row in rejected))
    for row in rows:
        row |= batches.get(row["recording"], dict.fromkeys(BATCH_COLUMNS))
        if row[NEAR_COPIES]:
            print(f"{row['recording']}: nearly the same as {row[NEAR_COPIES].replace(' ', ', ')}")
    table, *passed_over = arguments.output
    for path in passed_over:
        others = [{"path": name, "reason": text} for name, text in archive.passed_over.items()]
        files.write_csv(path, ["path", "reason"], others)
    files.write_csv(table, [*COLUMNS, NEAR_COPIES, *BATCH_COLUMNS], rows)


if __name__ == "__main__":
    run(main)
