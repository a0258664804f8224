"""Make all results again in a temporary folder, and name each one on disk that differs."""

import argparse
import sys

from capsule import files
from capsule.verify import verify
from capsule.workflow_call import data_folder

_MOST = 20


def tell(names: list[str], what: str) -> None:
    """Print the first files of a list, and the number of the others."""
    for name in names[:_MOST]:
        print(f"  {what}: results/{name}")
    if len(names) > _MOST:
        print(f"  ... and {len(names) - _MOST} more")


def main() -> None:
    """Compare all results; the exit status is 0 only if all are equal."""
    parser = argparse.ArgumentParser(
        description=__doc__, epilog="exit status: 0 all results are the same, 1 some differ"
    )
    cores = "number of jobs that run at the same time; all: one per core (default: 2)"
    parser.add_argument("--cores", default="2", metavar="N", help=cores)
    found = verify(data_folder(), parser.parse_args().cores)
    if found.waiting:
        print(f"the results are not up to date, so differences are expected: {found.waiting}")
    print(f"{found.same} results are the same as when made again; the page is not compared")
    tell(found.different, "differs")
    tell(found.missing, "is missing")
    tell(found.left_over, "is of a recording or a batch that is gone")
    if found.different or found.missing:
        print("to make a result again, delete it: snakemake -c2 makes all that is missing")
        sys.exit(1)


if __name__ == "__main__":
    files.run(main)
