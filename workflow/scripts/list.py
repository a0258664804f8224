"""List every file under raw/: accepted, rejected or passed over, with the reason."""

import argparse
from pathlib import Path

from capsule.recordings.listing import COLUMNS, NEAR_COPIES, full_list, refuse_rejected
from capsule.recordings.names import Archive
from capsule.store import files
from capsule.store.results import CHECKS, Results


def main() -> None:
    """Write the list of the recordings; with --on-rejected fail, stop at a rejection."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--raw", type=Path, required=True, help="the folder of recordings")
    parser.add_argument("--results", type=Path, required=True, help="the folder of results")
    parser.add_argument("--batch-size", type=int, required=True, help="recordings in a batch")
    parser.add_argument("--on-rejected", choices=["report", "fail"], default="report")
    parser.add_argument("--which", choices=["all", "labelled"], default="all")
    parser.add_argument(
        "--output", type=Path, nargs="+", required=True, help="output: recordings, other files"
    )
    arguments = parser.parse_args()
    archive = files.list_archive(arguments.raw)
    if arguments.which == "labelled":
        archive = Archive(tuple(archive.labelled()), {}, {})
    results = Results(arguments.results, archive.recordings, arguments.batch_size)
    made = [name for name in archive.recordings if results.file(CHECKS, name).exists()]
    if missing := sorted(set(archive.recordings) - set(made)):
        print(f"added while the workflow ran, run it again to include: {', '.join(missing)}")
    rows = full_list(archive, results.checks(made), results.signal)
    rejected = [row for row in rows if row["status"] != "accepted"]
    print(f"{len(rows) - len(rejected)} recordings accepted, {len(rejected)} rejected")
    if arguments.on_rejected == "fail":
        refuse_rejected(rows)
    print("\n".join(f"{row['recording']}: {row['reason']}" for row in rejected))
    for row in rows:
        if row[NEAR_COPIES]:
            print(f"{row['recording']}: nearly the same as {row[NEAR_COPIES].replace(' ', ', ')}")
    table, *passed_over = arguments.output
    for path in passed_over:
        others = [{"path": name, "reason": text} for name, text in archive.passed_over.items()]
        files.write_csv(path, ["path", "reason"], others)
    files.write_csv(table, [*COLUMNS, NEAR_COPIES], rows)


if __name__ == "__main__":
    files.run(main)
