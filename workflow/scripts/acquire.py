"""Record a run of the capsule from the logger board into raw/."""

import os
import signal
import sys

from acquisition.bench_errors import INTERRUPTED, AcquisitionError

if __name__ == "__main__":
    # Until the imports are done, Ctrl-C would end in a traceback from within one of them.
    signal.signal(
        signal.SIGINT, lambda *_: (os.write(2, f"{INTERRUPTED}\n".encode()), os._exit(130))
    )

from acquisition import options, output, run
from edges import files


def main() -> None:
    """Record, or recover; each fault at the bench has its own exit status."""
    try:
        signal.signal(signal.SIGINT, signal.default_int_handler)
        arguments = options.parse()
        if arguments.recover is not None:
            run.recover(arguments)
        else:
            run.record(arguments)
    except AcquisitionError as error:
        print(f"error: {error}", file=sys.stderr)
        sys.exit(error.status)
    except KeyboardInterrupt:
        print(INTERRUPTED, file=sys.stderr)
        sys.exit(130)


if __name__ == "__main__":
    output.install()
    files.run(main)
