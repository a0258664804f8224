"""The command line of export.py."""

import argparse
from pathlib import Path

from edges.workflow_call import data_config, data_folder
from exporting.export_provenance import PROJECT
from exporting.gathering import ALL, CHOICES

SCHEMA = PROJECT / "workflow" / "schemas" / "config.schema.json"
EXTRA = 'pip install "origami-capsule[export]"'
# Each is written by the module of that name: mat_export, xlsx_export, ...
FORMATS = ("mat", "xlsx", "parquet", "netcdf", "nwb")

EXAMPLES = """
examples:
  %(prog)s --format mat                     everything, as export/all.mat
  %(prog)s --format parquet --what evaluation --out tables/
  %(prog)s --format nwb --what recordings   one NWB file a recording, in export/

docs/export.md shows how to open each format in MATLAB, Python, R and Excel.
"""


def read_arguments(arguments: list[str] | None = None) -> argparse.Namespace:
    """Read what to export, and where to."""
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
