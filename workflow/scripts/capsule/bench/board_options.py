"""The options for the ports of the boards and the wave, for records and surveys."""

import argparse

from capsule.arguments import positive
from capsule.bench.line import BAUD


def add_board_options(parser: argparse.ArgumentParser) -> None:
    """Add the options for the logger's port and the waiting time."""
    group = parser.add_argument_group("the logger board")
    group.add_argument("--port", help="serial port (default: search the USB ports)")
    group.add_argument(
        "--baud", type=int, default=BAUD, help="bits per second (default: %(default)s)"
    )
    group.add_argument(
        "--patience",
        type=positive,
        default=60.0,
        metavar="S",
        help="longest wait for the next sample in seconds, also while the board is unplugged "
        "(default: %(default)g)",
    )


def add_wave_options(parser: argparse.ArgumentParser) -> None:
    """Add the options for the peristalsis board's port and the wave."""
    group = parser.add_argument_group("the peristalsis board")
    group.add_argument("--drive", metavar="PORT", help="start and stop the wave at this port")
    group.add_argument(
        "--speed",
        type=positive,
        default=25.0,
        metavar="MM_S",
        help="speed of the wave in mm/s (default: %(default)g)",
    )
    group.add_argument(
        "--ramp",
        type=positive,
        default=25.0,
        metavar="MM_S2",
        help="acceleration of the wave in mm/s^2 (default: %(default)g)",
    )
    group.add_argument(
        "--direction",
        choices=("forward", "backward"),
        default="forward",
        help="direction of the wave (default: %(default)s)",
    )
