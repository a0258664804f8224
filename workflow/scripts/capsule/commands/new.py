"""Make a folder of its own for a bench: the settings, raw/, and a Snakefile that runs the steps."""

import argparse
import json
import re
from pathlib import Path

from capsule.engine.project import CONFIG, PROJECT
from capsule.errors import CapsuleError, WrongOptionError
from capsule.store import files

EPILOG = """
Every command works in the folder that it is called in:
  capsule new pig-7 && cd pig-7
  capsule record --size 3          records into pig-7/raw/
  capsule report                   makes pig-7/results/report.html, as does: snakemake -c2
"""
_README = """# {name}

The folder of a bench with {sensors} sensors. Every command works in it:

    capsule import FILES --size 3    # your files; 0: no nodule, unlabelled: what is to be judged
    capsule record --size 3          # or a run from the logger board
    capsule report                   # makes results/report.html

Recordings lie in `raw/`, in a folder for each size. `config/config.yaml` holds the settings and
explains each. The manual: {manual}
"""
PROFILE = Path("profiles", "default", "config.yaml")
# The shipped configuration holds out a session of the shipped recordings, which this folder lacks.
_HELD_OUT = re.compile(r"held_out: \[.*?\]( *# sessions that only judge)?")
# The paper's: four sensors, and a matrix of 250 columns for each.
_SENSORS, _COLUMNS = 4, 250


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    parser.epilog = EPILOG
    parser.add_argument("folder", type=Path, metavar="NAME", help="the new folder")
    sensors = "number of sensors (default: 4); the matrix gets as many columns as they need"
    parser.add_argument("--sensors", type=int, default=_SENSORS, metavar="N", help=sensors)


def main(arguments: argparse.Namespace) -> None:
    """Make the folder, and print what comes next.

    Raises
    ------
    CapsuleError
        The folder exists and is not empty; nothing was written.
    WrongOptionError
        The number of sensors cannot be used.
    """
    make_folder(arguments.folder, arguments.sensors)
    print(f"{arguments.folder}/ is ready. Go there, and record or import: cd {arguments.folder}")


def make_folder(folder: Path, sensors: int = _SENSORS) -> None:
    """Fill a new or empty folder: settings for its sensors, raw/, a Snakefile and a README."""
    if is_taken(folder):
        raise CapsuleError(
            f"{folder} exists and is not empty; nothing was written, give a new name"
        )
    for name, content in _contents(folder, sensors).items():
        with files.write_whole(folder / name) as stream:
            stream.write(content)
    (folder / "raw").mkdir(exist_ok=True)


def is_taken(folder: Path) -> bool:
    """Return whether a path is a file, or a folder that is not empty."""
    return folder.exists() and (not folder.is_dir() or any(folder.iterdir()))


def own_configuration(sensors: int = _SENSORS) -> str:
    """Return the text of the shipped configuration for a bench of its own.

    It holds out no session. With another number of sensors than four, the matrix gets as many
    columns for each sensor, and the detector `taught` is left out, whose network takes four.

    Raises
    ------
    WrongOptionError
        No configuration can have this number of sensors.
    """
    if not 1 <= sensors <= 64:
        raise WrongOptionError(f"--sensors {sensors}: give a number from 1 to 64")
    text = (CONFIG / "config.yaml").read_text(encoding="utf-8")
    text = _HELD_OUT.sub("held_out: []              # sessions that only judge", text)
    if sensors == _SENSORS:
        return text
    length = max(sensors, _SENSORS) * _COLUMNS
    for shipped, own in (
        (f"sensors: {_SENSORS} ", f"sensors: {sensors} "),
        (f"length: {_SENSORS * _COLUMNS} ", f"length: {length} "),
        (", taught] ", "]         "),
    ):
        text = text.replace(shipped, own)
    return text


def _contents(folder: Path, sensors: int) -> dict[str, str]:
    steps, profile = (
        (PROJECT / name).read_text(encoding="utf-8") for name in ("Snakefile", str(PROFILE))
    )
    elsewhere = json.dumps((PROJECT / "workflow" / "Snakefile").as_posix())
    checkout = (PROJECT / "docs" / "index.md").is_file()
    manual = f"{PROJECT.as_posix()}/docs/index.md" if checkout else "docs/index.md of the project"
    return {
        "config/config.yaml": own_configuration(sensors),
        "Snakefile": steps.replace('"workflow/Snakefile"', elsewhere),
        # With it, the same command goes on after a run was killed.
        PROFILE.as_posix(): profile,
        "README.md": _README.format(name=folder.resolve().name, sensors=sensors, manual=manual),
    }
