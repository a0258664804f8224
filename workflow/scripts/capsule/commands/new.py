"""Make a folder of its own for a bench: the settings, raw/, and a Snakefile that runs the steps."""

import argparse
import json
import re
from pathlib import Path

from capsule.engine.project import CONFIG, PROJECT
from capsule.errors import CapsuleError
from capsule.store import files

EPILOG = """
Every command works in the folder that it is called in:
  capsule new pig-7 && cd pig-7
  capsule record --size 3          records into pig-7/raw/
  capsule report                   makes pig-7/results/report.html, as does: snakemake -c2
"""
_README = """# {name}

Recordings go into `raw/`, in a folder for each size (`raw/3mm/`, `raw/0mm/`, `raw/unlabelled/`).
`capsule record --size 3` writes them there, `capsule import FILE --size 3` brings others.
`capsule report` makes `results/report.html`; `config/config.yaml` holds the settings.
"""
PROFILE = Path("profiles", "default", "config.yaml")
# The shipped configuration holds out a session of the shipped recordings, which this folder lacks.
_HELD_OUT = re.compile(r"held_out: \[.*?\]")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    parser.epilog = EPILOG
    parser.add_argument("folder", type=Path, metavar="NAME", help="the new folder")


def main(arguments: argparse.Namespace) -> None:
    """Make the folder, and print what comes next.

    Raises
    ------
    CapsuleError
        The folder exists and is not empty; nothing was written.
    """
    make_folder(arguments.folder)
    print(f"{arguments.folder}/ is ready. Go there, and record or import: cd {arguments.folder}")


def make_folder(folder: Path) -> None:
    """Make a folder with settings, raw/, a Snakefile and a README.

    Parameters
    ----------
    folder : Path
        A new or empty folder.

    Raises
    ------
    CapsuleError
        The folder exists and is not empty; nothing was written.
    """
    if is_taken(folder):
        raise CapsuleError(
            f"{folder} exists and is not empty; nothing was written, give a new name"
        )
    for name, content in _contents(folder).items():
        with files.write_whole(folder / name) as stream:
            stream.write(content)
    (folder / "raw").mkdir(exist_ok=True)


def is_taken(folder: Path) -> bool:
    """Return whether a path is a file, or a folder that is not empty."""
    return folder.exists() and (not folder.is_dir() or any(folder.iterdir()))


def own_configuration() -> str:
    """Return the text of the shipped configuration, without the session that it holds out."""
    return _HELD_OUT.sub("held_out: []", (CONFIG / "config.yaml").read_text(encoding="utf-8"))


def _contents(folder: Path) -> dict[str, str]:
    steps, profile = (
        (PROJECT / name).read_text(encoding="utf-8") for name in ("Snakefile", str(PROFILE))
    )
    elsewhere = json.dumps((PROJECT / "workflow" / "Snakefile").as_posix())
    return {
        "config/config.yaml": own_configuration(),
        "Snakefile": steps.replace('"workflow/Snakefile"', elsewhere),
        # With it, the same command goes on after a run was killed.
        PROFILE.as_posix(): profile,
        "README.md": _README.format(name=folder.resolve().name),
    }
