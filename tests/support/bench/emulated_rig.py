"""Make a bench for surveys with the real firmware of the boards with motors, in the emulator."""

from pathlib import Path

from support.bench import emulated
from support.bench.closed_loop import HALF_STEPS_PER_MM
from support.bench.folding import SWITCH_TRAVEL, TRAVEL, FoldingOrigami
from support.bench.rig import Rig
from support.bench.stand_in_motors import WAVELENGTH_MM


class Cams:
    """The cam shaft on the peristalsis board's motor, with attributes of `StandInPeristalsis`."""

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


class EmulatedRig(Rig):
    """A `Rig` with some real boards in the emulator.

    Parameters
    ----------
    folder : Path
        Folder of ports and sessions.
    *real : str
        Boards that run their firmware: ``wave``, ``fold``.
    """

    # Shorter than the time that a motor needs to move through a switch.
    stretch_us = 50_000

    def __init__(self, folder: Path, *real: str) -> None:
        self._real = real
        super().__init__(folder)

    def _make_boards(self, indexed: bool) -> None:
        super()._make_boards(indexed)
        if "wave" in self._real:
            self.wave_board = emulated.EmulatedBoard(emulated.PERISTALSIS)
            self.wave = Cams(self.wave_board)
        if "fold" in self._real:
            self.fold_board = emulated.EmulatedBoard(emulated.FOLD)
            self.fold = Thread(self.fold_board)

    def _go_on(self, start_s: float, end_s: float) -> None:
        if "fold" in self._real:
            self.fold.origami(start_s, end_s)
        super()._go_on(start_s, end_s)
