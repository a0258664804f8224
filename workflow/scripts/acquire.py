"""Record a run of the capsule from the logger board into raw/."""

import _signal
import os

if __name__ == "__main__":
    # Until the imports are done, Ctrl-C would end in a traceback from within one of them; even
    # `signal` itself imports several modules.
    _signal.signal(_signal.SIGINT, lambda *_: os._exit(130))

import signal

from acquisition import options, output, run
from acquisition.bench_errors import INTERRUPTED, end_with_status
from edges import files


def main() -> None:
    """Record, or recover; each fault at the bench has its own exit status."""
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
