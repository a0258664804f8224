"""Make results/report.html from the recordings in raw/: Snakemake does what is not done yet."""

import argparse
import sys

from edges import files, workflow_call

DETAILS = """
It works in the current folder, where that holds raw/ and config/config.yaml, and otherwise in the
folder of the project. What follows two dashes goes to Snakemake as it is:

  capsule report -- -n            say what would be done, and why
  capsule report -- --forceall    do everything anew
"""


def main() -> None:
    """Make the report; the exit status is Snakemake's."""
    parser = argparse.ArgumentParser(
        description=__doc__,
        epilog=DETAILS,
        usage="%(prog)s [-h] [--cores N] [-- SNAKEMAKE_OPTION ...]",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    cores = "how many jobs may run side by side, or all: as many as there are cores (default: 2)"
    parser.add_argument("--cores", default="2", metavar="N", help=cores)
    parser.add_argument("options", nargs="*", help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    wanted = [f"--cores={arguments.cores}", "results/report.html", *arguments.options]
    sys.exit(workflow_call.call_workflow(workflow_call.data_folder(), wanted))


if __name__ == "__main__":
    files.run(main)
