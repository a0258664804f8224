"""Make a complete bench for surveys: three boards, their cables, a capsule in a gut, a survey."""

import csv
import json
from collections.abc import Sequence
from pathlib import Path
from types import SimpleNamespace

from capsule.phantom.files import DEFAULT_TABLE, read_phantom
from capsule.phantom.journey import Nodule
from capsule.phantom.parameters import with_values
from support.bench import emulated
from support.bench.closed_loop import HALF_STEPS_PER_MM
from support.bench.folding import SWITCH_TRAVEL, TRAVEL, FoldingOrigami
from support.bench.gut import Gut
from support.bench.surveyor import SteppedCable, Surveyor
from support.bench.workbench import Workbench

WAVELENGTH_MM = 80.0


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


class Rig:
    """A bench of boards for surveys; their firmware runs in the emulator.

    Parameters
    ----------
    folder : Path
        Folder of ports and sessions.
    length_mm : float
        Length of the gut, in mm.
    nodules : sequence of Nodule
        Nodules under the wall.
    **changes : float
        Parameters of the phantom, such as ``folding__speed_mm_s``.
    """

    # Time that the boards run before the world advances: no motor moves through a switch in it.
    stretch_us = 50_000

    def __init__(
        self,
        folder: Path,
        *,
        length_mm: float = 80.0,
        nodules: Sequence[Nodule] = (),
        seed: int = 7,
        **changes: float,
    ) -> None:
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
        phantom = read_phantom(DEFAULT_TABLE, [])
        named = {name.replace("__", "."): value for name, value in changes.items()}
        self.gut = Gut(
            with_values(phantom, named),
            self.wave,
            self.fold,
            self.logger,
            length_mm=length_mm,
            nodules=nodules,
            seed=seed,
        )
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

    def survey(self, *options: object, session: str = "tuesday") -> Surveyor:
        """Start capsule survey on these boards."""
        ports = ("--drive", self.cables.wave.port, "--fold", self.cables.fold.port)
        where = ("--port", self.cables.logger.port, "--out", self.folder / session)
        return Surveyor(
            self.folder, self.bench, self._all, self.stretch_us, *ports, *where, *options
        )

    def resume(self, *options: object, session: str = "tuesday") -> Surveyor:
        """Start capsule survey to continue a session."""
        return self._start("--resume", self.folder / session, *options)

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

    # Readers of a session's files.

    def events(self, session: str = "tuesday") -> list[dict]:
        """Read the log of events."""
        (path,) = (self.folder / session).glob("events.jsonl*")
        return [json.loads(line) for line in path.read_text().splitlines()]

    def places(self, session: str = "tuesday") -> list[dict]:
        """Read the table of places."""
        lines = (self.folder / session / "places.csv").read_text().splitlines()
        return list(csv.DictReader(lines))

    def stream(self, session: str = "tuesday") -> list[list[str]]:
        """Read the rows of the stream."""
        (path,) = (self.folder / session).glob("stream.csv*")
        return [line.split(",") for line in path.read_text().splitlines()[1:]]
