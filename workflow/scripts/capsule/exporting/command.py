"""Write recordings and results for other programs."""

import argparse
import io
import sys
from pathlib import Path

from capsule.engine.project import config_file, not_installed
from capsule.errors import CapsuleError
from capsule.exporting.formats import FORMATS
from capsule.exporting.gathering import ALL, CHOICES, Exported, gather
from capsule.store import files

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
    out, results = Path("export"), Path("results")
    add("--out", type=Path, default=out, metavar="FOLDER", help="output folder (default: export)")
    add("--results", type=Path, default=results, help="folder of results (default: results/)")
    here = "configuration (default: config/config.yaml here)"
    add("--config", type=Path, default=config_file(), help=here)
    add("--force", action="store_true", help="overwrite files that exist")


def main(arguments: argparse.Namespace) -> None:
    """Read the results, and write them in the chosen format.

    Raises
    ------
    CapsuleError
        A result is missing, a file exists, or the format's package is not installed.
    """
    exported = gather(arguments.results, arguments.config, arguments.what)
    written = write(exported, arguments.format, arguments.out, force=arguments.force)
    if (changed := exported.provenance["results_out_of_date"]) != "no":
        print(
            f"warning: since {arguments.results}/ was made, these came, went or changed: "
            f"{changed}; make it again: snakemake -c2 results/report.html"
        )
    count = "1 file" if len(written) == 1 else f"{len(written)} files"
    size, origin = sum(written) / 1e6, exported.provenance["origin"]
    print(f"{count}, {size:.1f} MB in {arguments.out}/; recordings: {origin}")


def write(exported: Exported, kind: str, out: Path, *, force: bool) -> list[int]:
    """Write the files of a format into a folder, and return the size of each in bytes.

    Raises
    ------
    CapsuleError
        A file exists and is not to be overwritten, or a package is missing; nothing was written.
    """
    contents = FORMATS[kind](exported)
    existing = [out / name for name in contents if (out / name).exists()]
    if existing and not force:
        more = f" (as do {len(existing) - 1} more)" if len(existing) > 1 else ""
        raise CapsuleError(
            f"{existing[0]} exists{more}; nothing was written. Choose another --out, or overwrite "
            "with --force"
        )
    written = []
    for name, fill in contents.items():
        with files.write_whole(out / name, "wb") as stream:
            try:
                fill(stream)
            except ModuleNotFoundError as error:
                raise not_installed(f"--format {kind} needs {error.name}", "formats") from None
            written.append(stream.seek(0, io.SEEK_END))
        if sys.stderr.isatty():
            progress = f"\rwritten: {len(written)} of {len(contents)}"
            end = "\n" if len(written) == len(contents) else ""
            print(progress, end=end, file=sys.stderr, flush=True)
    return written
