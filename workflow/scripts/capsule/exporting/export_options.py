"""Define and read the command line of export.py."""

import argparse
from pathlib import Path

from capsule.exporting.gathering import ALL, CHOICES
from capsule.workflow_call import data_config, data_folder

EXTRA = 'pip install "origami-capsule[export]"'
# The module of a format has its name: mat_export, xlsx_export and so on.
FORMATS = ("mat", "xlsx", "parquet", "netcdf", "nwb")

EXAMPLES = """
examples:
  %(prog)s --format mat                     write everything to export/all.mat
  %(prog)s --format parquet --what evaluation --out tables/
  %(prog)s --format nwb --what recordings   write one NWB file for each recording

docs/export.md shows how to open each format in MATLAB, Python, R and Excel.
"""


def read_arguments(arguments: list[str] | None = None) -> argparse.Namespace:
    """Read the command line: the format, the kind of data and the output folder."""
    parser = argparse.ArgumentParser(
        description="Export recordings and results for other programs.",
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    add = parser.add_argument
    add("--format", required=True, choices=FORMATS, help="the format of the files")
    add("--what", default=ALL, choices=CHOICES, help="what is exported (default: all)")
    out = Path("export")
    add("--out", type=Path, default=out, metavar="FOLDER", help="output folder (default: export)")
    results = data_folder() / "results"
    add("--results", type=Path, default=results, help="folder of results (default: results/)")
    config = data_config()
    add("--config", type=Path, default=config, help="configuration (default: config/config.yaml)")
    add("--force", action="store_true", help="overwrite files that exist")
    return parser.parse_args(arguments)
