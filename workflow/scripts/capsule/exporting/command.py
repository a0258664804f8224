"""Write recordings and results for other programs."""

import argparse
import io
import sys
from functools import partial
from pathlib import Path

from capsule import files
from capsule.configuration import read_settings
from capsule.errors import CapsuleError
from capsule.exporting.formats import FORMATS
from capsule.exporting.gathering import ALL, CHOICES, Exported, gather
from capsule.exporting.provenance import outdated
from capsule.project import config_file, how_to_install
from capsule.words import plural

EXAMPLES = """
examples:
  %(prog)s --format mat                     write everything to export/all.mat
  %(prog)s --format parquet --what evaluation --out tables/
  %(prog)s --format nwb --what recordings   write one NWB file for each recording

docs/export.md shows how to open each format in MATLAB, Python, R and Excel.
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options: the format, the kind of data and the output folder."""
    parser.epilog = EXAMPLES
    add = parser.add_argument
    add("--format", required=True, choices=FORMATS, help="the format of the files")
    add("--what", default=ALL, choices=CHOICES, help="what is exported (default: all)")
    out = Path("export")
    add("--out", type=Path, default=out, metavar="FOLDER", help="output folder (default: export)")
    results = Path("results")
    add("--results", type=Path, default=results, help="folder of results (default: results/)")
    config = config_file()
    add(
        "--config",
        type=Path,
        default=config,
        help="configuration (default: config/config.yaml here)",
    )
    add("--force", action="store_true", help="overwrite files that exist")


def main(arguments: argparse.Namespace) -> None:
    """Read the results, and write them in the chosen format.

    Raises
    ------
    CapsuleError
        A result is missing, a file exists, or the format's package is not installed.
    """
    settings = read_settings(arguments.config)
    progress = partial(tell, what="recordings read:")
    exported = gather(arguments.results, arguments.config, settings, arguments.what, progress)
    count, written = write(exported, arguments.format, arguments.out, force=arguments.force)
    if changed := outdated(arguments.results, settings):
        print(
            f"warning: {plural(len(changed), 'recording')} came, went or changed since "
            f"{arguments.results}/ was made, such as {changed[0]}; make it again: "
            "snakemake -c2 results/report.html"
        )
    origin = exported.provenance["origin"]
    files_written = "1 file" if count == 1 else f"{count} files"
    print(f"{files_written}, {written / 1e6:.1f} MB in {arguments.out}/; recordings: {origin}")


def tell(done: int, of: int, what: str) -> None:
    """Print the progress in one line, if standard error is a terminal."""
    if sys.stderr.isatty():
        end = "\n" if done == of else ""
        print(f"\r{what} {done} of {of}", end=end, file=sys.stderr, flush=True)


def write(exported: Exported, kind: str, out: Path, *, force: bool) -> tuple[int, int]:
    """Write the files of a format.

    Parameters
    ----------
    exported : Exported
        The data.
    kind : str
        The format.
    out : Path
        The output folder.
    force : bool
        Whether existing files are overwritten.

    Returns
    -------
    tuple of int
        Number of files, and their total size in bytes.

    Raises
    ------
    CapsuleError
        A file exists, or a package is missing; nothing was written.
    """
    contents = FORMATS[kind](exported)
    existing = [out / name for name in contents if (out / name).exists()]
    if existing and not force:
        more = f" (as do {len(existing) - 1} more)" if len(existing) > 1 else ""
        raise CapsuleError(
            f"{existing[0]} exists{more}; nothing was written. Choose another --out, or overwrite "
            "with --force"
        )
    written = 0
    for done, (name, fill) in enumerate(contents.items(), start=1):
        with files.write_whole(out / name, "wb") as stream:
            try:
                fill(stream)
            except ModuleNotFoundError as error:
                raise CapsuleError(
                    f"--format {kind} needs {error.name}, which is not installed; run "
                    f"{how_to_install('formats')}"
                ) from None
            written += stream.seek(0, io.SEEK_END)
        tell(done, len(contents), "written:")
    return len(contents), written
