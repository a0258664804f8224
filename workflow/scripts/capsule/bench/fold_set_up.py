"""Set up a fold board that does not know its thread: a person looks, and confirms."""

import sys
from collections.abc import Callable

from capsule.bench.bench_errors import AcquisitionError, LineLostError
from capsule.bench.boards import connect, request

SET_UP = "setup,unfolded"
ANSWER = "unfolded"
_QUESTION = f"""\
The fold board keeps how far its thread is wound. A board that is new, or has lost this, does not
move until somebody has looked. Look at the origami now:

  - it is unfolded, so that the switch "unfolded" is closed,
  - its thread is slack, with at least three spare turns on the spool.

If both is so, type {ANSWER!r}: """


def set_up_fold(port: str, baud: int, ask: Callable[[str], str] = input) -> None:
    """Ask the user to look at the origami, and tell the fold board that it is unfolded.

    Parameters
    ----------
    port : str
        The fold board's port.
    baud : int
        Bits per second.
    ask : callable
        Function that asks the user a question.

    Raises
    ------
    AcquisitionError
        There is no terminal to ask at, the user does not confirm, the board is missing or another
        one, or it refuses, such as with a switch "unfolded" that is not closed.
    """
    if not sys.stdin.isatty():
        raise AcquisitionError(
            "--fold-set-up asks a person who looks at the origami; run it on a terminal"
        )
    line, identity = connect(port, baud, "fold")
    try:
        if identity.entries.get("setup") == "yes":
            print(f"the fold board at {port} is set up; nothing is to be done", flush=True)
            return
        try:
            answer = ask(_QUESTION)
        except EOFError:
            answer = ""
        if answer.strip().strip("'\"").lower() != ANSWER:
            raise AcquisitionError(
                f"{answer!r} is not {ANSWER!r}, so the fold board at {port} is not set up; wind or "
                "unwind the thread by hand, then run the same command again"
            )
        try:
            request(line, SET_UP)
        except LineLostError as fault:
            raise AcquisitionError(
                f"the fold board at {port} was disconnected: {fault}; run the same command again"
            ) from fault
    finally:
        line.close()
    print(f"the fold board at {port} is set up", flush=True)
