"""Write recordings and results for other programs."""

import argparse
from functools import partial
from pathlib import Path

from capsule.exporting.export_provenance import outdated
from capsule.exporting.export_writing import tell, write
from capsule.exporting.gathering import ALL, CHOICES, gather
from capsule.project import config_file
from capsule.settings import read_settings
from capsule.words import plural

# The module of a format has its name: mat_export, xlsx_export and so on.
FORMATS = ("mat", "xlsx", "parquet", "netcdf", "nwb")

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
