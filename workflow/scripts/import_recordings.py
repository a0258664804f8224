"""Write recordings from other programs' files into raw/."""

import sys

from capsule import files
from capsule.importing.import_options import build_parser
from capsule.importing.import_run import Importer


def main() -> None:
    """Import the given files and print their number; exit with status 1 if a file was refused."""
    importer = Importer(build_parser().parse_args())
    importer.run()
    print(importer.summary(), flush=True)
    sys.exit(1 if importer.refused else 0)


if __name__ == "__main__":
    files.run(main)
