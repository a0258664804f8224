"""Record a run of the capsule from the logger board into raw/."""

import _signal
import os

if __name__ == "__main__":
    # During the imports, Ctrl-C would end in a traceback; even `signal` imports several modules.
    _signal.signal(_signal.SIGINT, lambda *_: os._exit(130))

import signal

from capsule import files
from capsule.bench import options, output, run
from capsule.bench.bench_errors import INTERRUPTED, end_with_status


def main() -> None:
    """Record a run or recover one; each fault at the bench has its own exit status."""
    with end_with_status(INTERRUPTED):
        signal.signal(signal.SIGINT, signal.default_int_handler)
        arguments = options.parse()
        if arguments.recover is not None:
            run.recover(arguments)
        else:
            run.record(arguments)


if __name__ == "__main__":
    output.install()
    files.run(main)
