"""Write the shipped archive's numbers into README and manual, and draw the picture of a verdict.

A number stands between two comments, ``<!-- found -->19<!-- . -->``, and this script replaces it by
that of results/, which `make report` makes from raw/. So documents and report say the same.
"""

import argparse
import json
import re
import sys
from collections.abc import Mapping
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "workflow" / "scripts"))

from capsule.commands import cli
from capsule.engine.configuration import read_settings
from capsule.evaluation.archive_rates import leading
from capsule.evaluation.cross_validation import HELD_OUT
from capsule.evaluation.files import read_table
from capsule.evaluation.rates import of_any
from capsule.store.results import OfArchive
from capsule.words import interval, percent

# What README shows: an ordinary recording of the held-out session.
PICTURED = "3mm/h05"
_NUMBER = re.compile(r"<!-- ([a-z_0-9]+) -->(.*?)<!-- \. -->")


def numbers(results: Path, config: Path) -> dict[str, str]:
    """Return each number of the documents by its name.

    Parameters
    ----------
    results, config : Path
        The folder of results, and the configuration.
    """
    settings = read_settings(config)
    evaluation, schemes = results / OfArchive.EVALUATION, settings["evaluation"]["schemes"]
    tables = [read_table(evaluation / f"{name}.csv") for name in ("summary", "detection", "sizing")]
    named = settings["report"]["lead"]
    shown = {"lead": leading(tables[0], settings["detectors"], schemes, named).detector}
    for prefix, detector in (("", shown["lead"]), ("paper_", settings["detectors"][0])):
        values, detection, sizes = (
            table[(table["detector"] == detector) & (table["scheme"] == HELD_OUT)]
            for table in tables
        )
        found = detection[detection["size_mm"] > 0]
        large = found[found["size_mm"] >= 2]
        for name, rows in (("small", found[found["size_mm"] < 2]), ("large", large)):
            shown[f"{prefix}{name}"] = f"{rows['tp'].sum()} of {(rows['tp'] + rows['fn']).sum()}"
        (row,) = detection[detection["size_mm"] == 0].to_dict("records")
        shown[f"{prefix}alarms"] = f"{row['fn']} of {row['tp'] + row['fn']}"
        shown[f"{prefix}specificity"] = percent(row["recall"])
        (row,) = of_any(values).to_dict("records")
        shown[f"{prefix}right"] = f"{100 * row['ppv']:.0f}"
        shown[f"{prefix}right_range"] = interval(row["ppv_low"], row["ppv_high"])
        (row,) = of_any(sizes).to_dict("records")
        shown[f"{prefix}size_error"] = f"{row['absolute_error_mm']:.2f} mm"
    listed = read_table(results / OfArchive.RECORDINGS)
    shown["recordings"] = str(len(listed))
    shown["page_mb"] = f"{(results / OfArchive.REPORT).stat().st_size / 1e6:.0f} MB"
    learned = json.loads((results / OfArchive.DETECTORS).read_text(encoding="utf-8"))
    shown["teach"] = str(learned["recordings"])
    shown["held_out"] = str(len(listed) - learned["recordings"])
    return shown


def filled(text: str, shown: Mapping[str, str]) -> str:
    """Return a document with its numbers replaced; a name that is unknown raises KeyError."""
    return _NUMBER.sub(lambda each: f"<!-- {each[1]} -->{shown[each[1]]}<!-- . -->", text)


def build_parser() -> argparse.ArgumentParser:
    """Return the parser of the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    check = "change nothing; exit status 1 if a document has another number"
    parser.add_argument("--check", action="store_true", help=check)
    return parser


def main() -> int:
    """Write the numbers and the picture."""
    arguments = build_parser().parse_args()
    results = ROOT / "results"
    shown = numbers(results, ROOT / "config" / "config.yaml")
    stale = []
    for path in (ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))):
        text = path.read_text(encoding="utf-8")
        if (fresh := filled(text, shown)) != text:
            stale.append(path.name)
            if not arguments.check:
                path.write_text(fresh, encoding="utf-8")
    print(f"other numbers: {', '.join(stale) or 'none'}")
    if arguments.check:
        return int(bool(stale))
    words = [f"{ROOT}/raw/{PICTURED}.csv", "--picture", f"{ROOT}/docs/judged.png"]
    judge = cli.build_parser(["judge"]).parse_args(["judge", *words, "--results", str(results)])
    return int(judge.main(judge))


if __name__ == "__main__":
    sys.exit(main())
