"""List every file under raw/: what was accepted, what was not, and why."""

import argparse
from collections.abc import Iterator
from pathlib import Path

from capsule.errors import CapsuleError
from capsule.naming import as_cell, folder_size_mm, reason_of_copy
from capsule.recording import source_of
from edges import files

FROM_HEADER = ["site", "session", "nodule_at_mm"]
COLUMNS = ["recording", "size_mm", "samples", "duration_s", "status", "reason", "sha256", "source"]
COLUMNS += FROM_HEADER


def rows_of(raw: Path, checks: Path) -> Iterator[dict]:
    """Give one row a recording, in order; of equal contents only the first is accepted."""
    archive = files.list_archive(raw)
    first_with: dict[str, str] = {}
    for name in archive.recordings:
        check_file = checks / f"{name}.json"
        if not check_file.exists():
            print(f"{name}: came while the workflow ran; run it again to take it in")
            continue
        check = files.read_json(check_file)
        check |= {key: as_cell(check["header"].get(key, "")) for key in FROM_HEADER}
        check["source"] = as_cell(source_of(check["header"]))
        if check["status"] == "accepted":
            # The readings, not the bytes: other line ends or headers make no other recording.
            original = first_with.setdefault(check["readings_sha256"], name)
            if original != name:
                check |= {"status": "rejected", "reason": reason_of_copy(original, name)}
        yield {column: check[column] for column in COLUMNS}
    for path, reason in archive.refused.items():
        row = dict.fromkeys(COLUMNS) | {"recording": path, "status": "rejected", "reason": reason}
        yield row | {"size_mm": folder_size_mm(path.partition("/")[0])}


def main() -> None:
    """Write recordings.csv and passed_over.csv; with --on-rejected fail, stop on a rejected one."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--raw", type=Path, required=True, help="the folder of recordings")
    parser.add_argument("--checks", type=Path, required=True, help="the folder of checks")
    parser.add_argument("--on-rejected", choices=["report", "fail"], default="report")
    parser.add_argument("--output", type=Path, required=True, help="output: recordings.csv")
    parser.add_argument("--passed-over", type=Path, required=True, help="output: the other files")
    arguments = parser.parse_args()
    rows = list(rows_of(arguments.raw, arguments.checks))
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
    others = files.list_archive(arguments.raw).passed_over
    passed_over = [{"path": path, "reason": reason} for path, reason in others.items()]
    files.write_csv(arguments.passed_over, ["path", "reason"], passed_over)
    files.write_csv(arguments.output, COLUMNS, rows)


if __name__ == "__main__":
    files.run(main)
