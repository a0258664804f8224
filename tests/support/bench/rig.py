"""Make a complete bench for surveys: three boards, their cables, a capsule in a gut, a survey."""

import json
from collections import deque
from pathlib import Path
from types import SimpleNamespace

import numpy as np

from capsule.phantom.files import DEFAULT_TABLE, read_phantom
from capsule.phantom.journey import Journey
from support.bench import emulated
from support.bench.emulated import HALF_STEPS_PER_MM
from support.bench.folding import SWITCH_TRAVEL, TRAVEL, FoldingOrigami
from support.bench.surveyor import SteppedCable, Surveyor
from support.bench.workbench import Workbench

WAVELENGTH_MM = 80.0
GUT_MM = 80.0  # where the end stop is
_AT_ONCE = 8


class Cams:
    """The cam shaft on the peristalsis board's motor, whose index closes a switch."""

    def __init__(self, board: emulated.EmulatedBoard) -> None:
        self._board = board
        turn = WAVELENGTH_MM * HALF_STEPS_PER_MM
        board.set_cam(turn, turn / 3, turn / 20)

    @property
    def cam_mm(self) -> float:
        """The distance that the cams have carried the wave, in mm."""
        return self._board.half_steps / HALF_STEPS_PER_MM

    @property
    def state(self) -> str:
        """The state of the motor: running or stopped."""
        return "running" if self._board.coils else "stopped"


class Thread:
    """The thread on the fold board's motor; `folded` is 0 or 1 if an end switch is closed."""

    def __init__(self, board: emulated.EmulatedBoard) -> None:
        self.origami = FoldingOrigami(board)

    @property
    def folded(self) -> float:
        """The folded share of the origami, 0..1."""
        way = (self.origami.wound - SWITCH_TRAVEL) / (TRAVEL - 2 * SWITCH_TRAVEL)
        return min(max(way, 0.0), 1.0)


class BentJourney(Journey):
    """A journey whose origami follows a motor's thread."""

    thread: Thread

    def _fold_on(self, samples: int) -> np.ndarray:
        before, self._folded = self._folded, self.thread.folded
        if self._folded > before:
            self.fold()
        elif self._folded < before:
            self.unfold()
        return np.linspace(before, self._folded, samples + 1)[1:]


class Gut:
    """A world that couples three boards through a capsule in a gut.

    The phantom is the simulator's journey, and the wave is its clock: it advances by a sample each
    time the cams have carried the wave by the distance of a sample's time.

    `head_mm` is the true place of the head.
    """

    def __init__(
        self,
        motor: Cams,
        thread: Thread,
        logger: emulated.EmulatedBoard,
    ) -> None:
        phantom = read_phantom(DEFAULT_TABLE, [])
        electronics = phantom.electronics
        self._journey = BentJourney(phantom, 7, "survey", [], 4, 12_000, GUT_MM)
        self._journey.thread = thread
        self._step_mm = phantom.wall.speed_mm_s / electronics.rate_hz
        self._mv = 1000 * electronics.vref_v / 2**electronics.adc_bits
        self._motor, self._thread, self._logger = motor, thread, logger
        self._cam_mm = motor.cam_mm
        # Samples that the wave has not reached yet.
        self._ahead: deque[tuple[np.ndarray, float]] = deque()
        self._before, self.head_mm = self._sample()
        self._after, _ = self._sample()
        self._before_mm = 0.0

    def __call__(self, start_s: float, end_s: float) -> None:
        """Move the capsule according to the motors in the last stretch of time."""
        del start_s, end_s
        way_mm = self._motor.cam_mm - self._cam_mm
        while way_mm > self._before_mm + self._step_mm:
            self._before_mm += self._step_mm
            self._before = self._after
            self._after, self.head_mm = self._sample()
        share = (way_mm - self._before_mm) / self._step_mm
        counts = self._before + share * (self._after - self._before)
        # Voltage in the middle of a step of the converter.
        voltages_mv = (counts + 0.5) * self._mv
        self._logger.set_voltages(voltages_mv, voltages_mv)
        self._logger.set_end_stop(self.head_mm >= GUT_MM)

    def _sample(self) -> tuple[np.ndarray, float]:
        """Return the next counts, and the place of the head."""
        if not self._ahead:
            folded = self._thread.folded
            # Several samples at once take less time, but not while the origami moves.
            way, counts = self._journey.advance(_AT_ONCE if folded in (0.0, 1.0) else 1)
            self._ahead.extend(zip(counts.T.astype(float), way.head_mm, strict=True))
        return self._ahead.popleft()


class Rig:
    """A bench of boards for surveys; their firmware runs in the emulator."""

    # Time that the boards run before the world advances: no motor moves through a switch in it.
    stretch_us = 50_000

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.logger = emulated.EmulatedBoard(emulated.LOGGER)
        self.wave_board = emulated.EmulatedBoard(emulated.PERISTALSIS)
        self.fold_board = emulated.EmulatedBoard(emulated.FOLD)
        self.wave, self.fold = Cams(self.wave_board), Thread(self.fold_board)
        boards = {"logger": self.logger, "wave": self.wave_board, "fold": self.fold_board}
        self.cables = SimpleNamespace(
            **{
                name: SteppedCable(board, folder / name, sticks=name == "logger")
                for name, board in boards.items()
            }
        )
        self.gut = Gut(self.wave, self.fold, self.logger)
        self._all = list(vars(self.cables).values())
        self.bench = Workbench(*self._all, world=self._go_on)

    def _go_on(self, start_s: float, end_s: float) -> None:
        """Advance thread and gut by the motion of the motors."""
        self.fold.origami(start_s, end_s)
        self.gut(start_s, end_s)

    @property
    def now_s(self) -> float:
        """The bench's time in seconds."""
        return self.bench.now_s

    def survey(self, *options: object) -> Surveyor:
        """Start capsule survey on these boards."""
        ports = ("--drive", self.cables.wave.port, "--fold", self.cables.fold.port)
        where = ("--port", self.cables.logger.port, "--out", self.folder / "tuesday")
        return self._start(*ports, *where, *options)

    def resume(self) -> Surveyor:
        """Start capsule survey to continue the session."""
        return self._start("--resume", self.folder / "tuesday")

    def _start(self, *options: object) -> Surveyor:
        return Surveyor(self.folder, self.bench, self._all, self.stretch_us, *options)

    def pass_by(self, seconds: float) -> None:
        """Advance the time without any program."""
        self.bench.run_for(seconds, stretch_us=self.stretch_us)

    def at_rest(self) -> bool:
        """Return whether the origami is unfolded and the wave stopped, after a survey has ended."""
        self.pass_by(2.0)
        return self.fold.folded == 0.0 and self.wave.state == "stopped"

    def end(self) -> None:
        """Pull all cables."""
        for cable in self._all:
            if cable.plugged:
                cable.unplug()

    # Readers of the session's files.

    def events(self) -> list[dict]:
        """Read the log of events."""
        (path,) = (self.folder / "tuesday").glob("events.jsonl*")
        return [json.loads(line) for line in path.read_text().splitlines()]

    def stream(self) -> list[list[str]]:
        """Read the rows of the stream."""
        (path,) = (self.folder / "tuesday").glob("stream.csv*")
        return [line.split(",") for line in path.read_text().splitlines()[1:]]
