"""Run a script or a command, whose errors are one line each.

Every script uses this module, so it imports only fast modules.
"""

import io
import os
import signal
import sys
from collections.abc import Callable

from capsule.engine.locks import is_job
from capsule.errors import CapsuleError, error_line

# Below the traceback of an error that is neither of the input nor of the disk.
FAULT = (
    "This is a fault of the program: report it with all lines above. Only if somebody has changed "
    "a file under results/, remove results/, and make it again: snakemake -c2"
)


def run(main: Callable[[], int | None]) -> None:
    """Run a script or a command; the program ends with its exit status (None: 0).

    An error of the input or of the disk is one line, without a traceback. A fault of the program
    keeps its traceback, and says that it is one. Ctrl-C ends the program with status 130.
    """
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")
    try:
        if is_job():
            signal.signal(signal.SIGINT, signal.default_int_handler)
        status = main()
        if status:
            sys.exit(status)
    except KeyboardInterrupt:
        sys.exit(130)
    except CapsuleError as error:
        print(error_line(error), file=sys.stderr)
        sys.exit(error.status)
    except BrokenPipeError:
        # The program that reads the output, such as `head`, wants no more. Python would fail once
        # more when it closes the stream.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        sys.exit(141)
    except OSError as error:
        sys.exit(error_line(error))
    except Exception as error:
        error.add_note(FAULT)
        raise
