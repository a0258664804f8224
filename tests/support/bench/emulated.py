"""Run the boards' real firmware in the emulator libsimavr."""

import atexit
import ctypes
import functools
import shutil
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import ClassVar

import numpy as np

from capsule.bench.protocol import Event, decode, encode
from support.command import output_of
from support.marks import missing_program, needs

HERE = Path(__file__).resolve().parent
FIRMWARE = HERE.parents[2] / "workflow" / "firmware"
LOGGER = "logger", "atmega2560"
PERISTALSIS = "peristalsis", "atmega328p"
FOLD = "fold", "atmega328p"
BOARDS = LOGGER, PERISTALSIS, FOLD
END_STOP, PIN_2, PIN_3 = range(3)  # the logger's switch, and those at an UNO's digital pins
MHZ = 16
# A fold board that is set up, its thread unwound: `record_t` of origami.h.
FIRST_RECORD = bytes.fromhex("01 00 00 00 00 00 00 00 00 00 7c 8e")
_STRETCH_US = 5000
# From docs/bench.md: half-steps of the motor for each mm of the wave.
HALF_STEPS_PER_MM = 64 * (32 / 9) * (22 / 11) * (26 / 9) * (31 / 10) / (3 * 80)


def missing_tools() -> str:
    """Return the reason why the emulator cannot run here; empty if it can."""
    packages = "gcc-avr avr-libc make gcc"
    if missing := missing_program("avr-gcc", "make", "gcc", packages=packages):
        return f"no emulator: {missing}"
    if not Path("/usr/include/simavr/sim_avr.h").exists():
        return "no emulator: libsimavr is not installed (Debian: libsimavr-dev libelf-dev)"
    return ""


# Mark of tests that need the emulator.
needed = needs(missing_tools())


def temporary_folder() -> Path:
    """Make a folder that is removed at the end of the test run, and return it."""
    folder = Path(tempfile.mkdtemp(prefix="capsule-bench-"))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return folder


@functools.cache
def build_folder() -> Path:
    """Build the firmware and the emulator's library once, and return their folder."""
    folder = temporary_folder()
    build_firmware(folder)
    library = folder / "libavrboard.so"
    warnings = ("-Wall", "-Wextra", "-Werror")
    source = HERE / "avr_board.c"
    output_of("gcc", "-O2", *warnings, "-shared", "-fPIC", source, "-o", library, "-lsimavr", "-lm")
    return folder


def build_host_library(*sources: Path, options: tuple[str, ...] = ()) -> ctypes.CDLL:
    """Build a library of the firmware's sources for this computer, and load it."""
    built = temporary_folder() / "lib.so"
    strict = ("-std=c11", "-O2", "-Wall", "-Wextra", "-Werror", "-shared", "-fPIC")
    output_of("gcc", *strict, *options, *sources, "-o", built)
    return ctypes.CDLL(str(built))


def build_firmware(folder: Path, defines: str = "") -> None:
    """Build the firmware of all boards into a folder, with further options of the compiler."""
    output_of("make", "-s", "-C", FIRMWARE, f"BUILD={folder}", f"DEFINES={defines}")


@functools.cache
def _library() -> ctypes.CDLL:
    library = ctypes.CDLL(str(build_folder() / "libavrboard.so"))
    board, text, number = ctypes.c_void_p, ctypes.c_char_p, ctypes.c_int
    moment, real = ctypes.c_ulonglong, ctypes.c_double
    for name, result, *arguments in (
        ("new", board, text, text),
        ("reset", None),
        ("skip", None, moment),
        ("run", number, moment),
        ("set_voltage", None, number, real),
        ("set_switch", None, number, number),
        ("set_cam", None, real, real, real),
        ("hang", number, number, number),
        ("memory", ctypes.POINTER(ctypes.c_ubyte)),
        ("read_eeprom", None, text, number),
        ("write_eeprom", None, number, text, number),
        ("take_sent", number, text, number),
        ("deliver", number, text, number),
    ):
        function = getattr(library, f"board_{name}")
        function.restype = result
        function.argtypes = arguments if name == "new" else (board, *arguments)
    return library


class Stamps(ctypes.Structure):
    """The processor's cycles at the last events: `stamps_t` of avr_board.c."""

    _fields_: ClassVar = [("cycles", ctypes.c_ulonglong * 8192), ("count", ctypes.c_ulong)]

    def times_us(self) -> np.ndarray:
        """Return the times in microseconds, the oldest first."""
        size = len(self.cycles)
        numbers = np.arange(max(self.count - size, 0), self.count)
        return np.array(self.cycles)[numbers % size] / MHZ


class Seen(ctypes.Structure):
    """What happened to a board: `seen_t` of avr_board.c."""

    _fields_: ClassVar = [
        ("half_steps", ctypes.c_long),
        ("illegal_steps", ctypes.c_ulong),
        ("watchdog_resets", ctypes.c_ulong),
        ("cycles", ctypes.c_ulonglong),
        ("cycles_asleep", ctypes.c_ulonglong),
        ("samples", Stamps),
        ("steps", Stamps),
    ]


class EmulatedBoard:
    """A board with its firmware, or another image of it; the caller advances its time.

    The memory of a fold board holds its first record. `normally_closed`: the contacts of end
    switches are closed until they are pressed.
    """

    def __init__(
        self, board: tuple[str, str], image: Path | None = None, *, normally_closed: bool = True
    ) -> None:
        name, mcu = board
        self._normally_closed = board != PERISTALSIS and normally_closed
        self._broken: set[int] = set()
        image = image or build_folder() / f"{name}.elf"
        self._library = _library()
        self._board = self._library.board_new(mcu.encode(), str(image).encode())
        if not self._board:
            raise RuntimeError(f"libsimavr cannot load {image} as {mcu}")
        self._memory = self._library.board_memory(self._board)
        self.seen = Seen.from_address(self._board)
        self._buffer = ctypes.create_string_buffer(65536)
        for switch in {LOGGER: (END_STOP,), FOLD: (PIN_2, PIN_3)}.get(board, ()):
            self.set_switch(switch, False)
        if board == FOLD:
            self.write_eeprom(0, FIRST_RECORD)

    @property
    def half_steps(self) -> int:
        """The half-steps of the rotor; forward counts up."""
        return self.seen.half_steps

    @property
    def coils(self) -> int:
        """The four coils, as bits of the register PORTB."""
        return self._memory[0x25] & 0xF

    def set_voltages(self, *voltages_mv: float) -> None:
        """Set the first analogue inputs."""
        for channel, voltage_mv in enumerate(voltages_mv):
            self._library.board_set_voltage(self._board, channel, voltage_mv)

    def set_switch(self, switch: int, closed: bool) -> None:
        """Press or release a switch: `END_STOP` of the logger, `PIN_2` or `PIN_3` of an UNO.

        The contacts of all but the peristalsis board's index are closed until they are pressed.
        """
        contact = closed != self._normally_closed and switch not in self._broken
        self._library.board_set_switch(self._board, switch, int(contact))

    def break_wire(self, switch: int) -> None:
        """Break the wire of a switch: its pin is open from now on."""
        self._broken.add(switch)
        self._library.board_set_switch(self._board, switch, 0)

    @property
    def eeprom(self) -> bytes:
        """The bytes of the fold board's two slots."""
        content = ctypes.create_string_buffer(32)
        self._library.board_read_eeprom(self._board, content, 32)
        return content.raw

    def write_eeprom(self, address: int, content: bytes) -> None:
        """Write into the EEPROM, whatever the firmware does."""
        self._library.board_write_eeprom(self._board, address, content, len(content))

    def set_cam(self, turn: float, index: float, closed: float) -> None:
        """Attach a cam to the motor; its index closes the switch at digital pin 3.

        All are half-steps of the rotor: in a turn, at the index, and while the switch stays closed.
        """
        self._library.board_set_cam(self._board, turn, index, closed)

    def hang(self, interrupts: bool, feeds_watchdog: bool = False) -> None:
        """Put the program into an endless loop, with or without interrupts and watchdog."""
        if not self._library.board_hang(self._board, int(interrupts), int(feeds_watchdog)):
            raise RuntimeError("the firmware has no endless loop behind main")

    def stop_timer(self) -> None:
        """Stop the interrupts of Timer1, as a flipped bit in its register TIMSK1 would."""
        self._memory[0x6F] = 0

    def advance(self, until_us: int) -> None:
        """Run the firmware to a point in time."""
        if self._library.board_run(self._board, until_us):
            raise RuntimeError("the emulated processor stopped")

    def skip(self, until_us: int) -> None:
        """Advance the time without the firmware, as without power or in the boot loader."""
        self._library.board_skip(self._board, until_us)

    def reset(self) -> None:
        """Press the reset button."""
        self._library.board_reset(self._board)

    def take_sent(self) -> bytes:
        """Return the bytes that the board has sent since the last call."""
        length = self._library.board_take_sent(self._board, self._buffer, len(self._buffer))
        return self._buffer.raw[:length]

    def deliver(self, received: bytes) -> None:
        """Send bytes to the board's UART."""
        self._library.board_deliver(self._board, received, len(received))


class Talk:
    """A conversation with a board, with options of `EmulatedBoard`.

    Its `world`, if there is one, sets voltages and switches after each stretch of time.
    """

    def __init__(
        self,
        board: tuple[str, str],
        world: Callable[[EmulatedBoard], Callable[[], None]] | None = None,
        **options: object,
    ) -> None:
        self.board = EmulatedBoard(board, **options)
        self.world = world(self.board) if world else None
        self.now_us = 0
        self.wait(0.05)  # it says what it is

    def wait(self, seconds: float) -> list[Event]:
        """Advance the time, and return the board's messages."""
        end_us = self.now_us + round(seconds * 1e6)
        while self.world and self.now_us < end_us:
            self.now_us = min(self.now_us + _STRETCH_US, end_us)
            self.world()
            self.board.advance(self.now_us)
        self.now_us = end_us
        self.board.advance(end_us)
        return [decode(line) for line in self.board.take_sent().splitlines()]

    def say(self, payload: str, seconds: float = 0.03) -> list[Event]:
        """Send a command, and return the answers."""
        self.board.deliver(encode(payload))
        return self.wait(seconds)
