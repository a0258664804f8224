"""Record a run of the capsule from the logger board into raw/."""

import sys

from acquisition import options, output, run
from acquisition.bench_errors import AcquisitionError
from edges import files


def main() -> None:
    """Record, or recover; each fault at the bench has its own exit status."""
    arguments = options.parse()
    try:
        if arguments.recover is not None:
            run.recover(arguments)
        else:
            run.record(arguments)
    except AcquisitionError as error:
        print(f"error: {error}", file=sys.stderr)
        sys.exit(error.status)
    except KeyboardInterrupt:
        print("interrupted before the recording began; nothing is archived", file=sys.stderr)
        sys.exit(130)


if __name__ == "__main__":
    output.install()
    files.run(main)
