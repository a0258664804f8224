"""Judge a recording by every detector: size with its interval, probability, place, and a plot."""

import argparse
import json
import shutil
import sys
from pathlib import Path

from capsule.bench import judged_file, judged_view
from capsule.bench.verdict import FinalVerdict, note_of_change
from capsule.configuration import read_settings
from capsule.errors import WrongOptionError
from capsule.project import config_file


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    parser.epilog = "exit status: 0 judged, 1 a file was rejected, or other fault"
    add = parser.add_argument
    add("files", type=Path, nargs="+", metavar="FILE", help="a recording, in any folder")
    results = "the workflow's results: detectors.json and templates.npz (default: results/)"
    add("--results", type=Path, default=Path("results"), metavar="FOLDER", help=results)
    config = "the workflow's configuration (default: config/config.yaml here, or the shipped one)"
    add("--config", type=Path, default=config_file(), metavar="FILE", help=config)
    picture = "draw the recording, and the place of the nodule, to a .png or .svg file"
    add("--picture", type=Path, metavar="FILE", help=picture)
    add("--json", action="store_true", help="print the verdicts as JSON, for other programs")


def main(arguments: argparse.Namespace) -> int:
    """Judge each file, and print the verdicts; return 0 only if all files were accepted.

    Raises
    ------
    CapsuleError
        The results or the configuration cannot be used.
    WrongOptionError
        Options contradict each other.
    """
    if arguments.picture and len(arguments.files) > 1:
        raise WrongOptionError("--picture draws one recording: give one FILE")
    if arguments.picture and arguments.picture.suffix not in (".png", ".svg"):
        raise WrongOptionError(f"--picture {arguments.picture}: the name must end in .png or .svg")
    settings, results = read_settings(arguments.config), arguments.results
    learned = results / "detectors.json"
    final = FinalVerdict(results / "templates.npz", learned, settings, "a verdict")
    if note := note_of_change(results, settings):
        print(note, file=sys.stderr)
    taught = judged_file.taught_recordings(results / "recordings.csv")
    judged = [judged_file.judge_file(path, final, settings, taught) for path in arguments.files]
    if arguments.json:
        rate_hz = settings["recording"]["rate_hz"]
        values = [judged_file.as_plain_values(each, rate_hz) for each in judged]
        print(json.dumps(values, indent=1, allow_nan=False))
    else:
        width = shutil.get_terminal_size().columns - 1
        plain = not (sys.stdout.encoding or "ascii").lower().startswith("utf")
        for each in judged:
            print("\n".join(judged_view.judged_lines(each, settings, width, plain=plain)))
    if arguments.picture and judged[0].is_accepted:
        from capsule.bench.judged_picture_file import write_picture  # matplotlib only if it is used

        write_picture(judged[0], settings, arguments.picture)
    return int(not all(each.is_accepted for each in judged))
