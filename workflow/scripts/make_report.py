"""Make results/report.html from the recordings in raw/: Snakemake runs the steps still missing."""

import argparse
import sys

from capsule import files, workflow_call

DETAILS = """
It works in the current folder if that holds raw/ and config/config.yaml, else in the folder of the
project. Options after two dashes go to Snakemake unchanged:

  capsule report -- -n            show the steps that would run, and why
  capsule report -- --forceall    run all steps again
"""


def main() -> None:
    """Make the report; the exit status is Snakemake's."""
    parser = argparse.ArgumentParser(
        description=__doc__,
        epilog=DETAILS,
        usage="%(prog)s [-h] [--cores N] [-- SNAKEMAKE_OPTION ...]",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    cores = "number of jobs that run at the same time; all: one per core (default: 2)"
    parser.add_argument("--cores", default="2", metavar="N", help=cores)
    parser.add_argument("options", nargs="*", help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    wanted = [f"--cores={arguments.cores}", "results/report.html", *arguments.options]
    sys.exit(workflow_call.call_workflow(workflow_call.data_folder(), wanted))


if __name__ == "__main__":
    files.run(main)
