"""The options of acquire.py that name streams of the Lab Streaming Layer."""

import argparse

from capsule.bench.lsl import EXTRA

DEFAULT_NAME = "capsule"
_LONGEST_NAME = 100


def add_stream_options(parser: argparse.ArgumentParser) -> None:
    """Add the options for the streams to send samples to and to record from."""
    group = parser.add_argument_group("streams of the Lab Streaming Layer", f"need {EXTRA}")
    group.add_argument(
        "--stream-out",
        nargs="?",
        const=DEFAULT_NAME,
        type=_stream_name,
        metavar="NAME",
        help=f"also send the samples as a stream while recording (default NAME: {DEFAULT_NAME})",
    )
    group.add_argument(
        "--stream-in",
        type=_stream_name,
        metavar="NAME",
        help="record from the stream of this name or source id instead of a logger board",
    )
    group.add_argument(
        "--stream-channels",
        metavar="LIST",
        help="channels to record, if the stream has more than sensors: labels or numbers from 1, "
        "such as 2,3,4,5; sensor 1 first",
    )


def fault_of_streams(options: argparse.Namespace) -> str:
    """Return which options contradict each other; empty if none do."""
    if options.stream_in and options.port:
        return "--stream-in records from a stream, --port from a board: give one of the two"
    if options.stream_channels and not options.stream_in:
        return "--stream-channels chooses channels of --stream-in NAME, which is not given"
    if options.stream_in and options.stream_in == options.stream_out:
        return f"--stream-in and --stream-out both name {options.stream_in!r}: rename one"
    return ""


def _stream_name(text: str) -> str:
    """Return the name of a stream; a name that would break a query is an error."""
    if not text.strip() or not text.isprintable() or "'" in text or len(text) > _LONGEST_NAME:
        raise argparse.ArgumentTypeError(
            f"{text[:_LONGEST_NAME]!r} is not allowed as a stream's name: use 1 to "
            f"{_LONGEST_NAME} printable characters other than '"
        )
    return text
