"""The bench of a survey with the real firmware of the boards with motors, in the emulator."""

from pathlib import Path

from support.bench import emulated
from support.bench.closed_loop import HALF_STEPS_PER_MM
from support.bench.folding import SWITCH_TRAVEL, TRAVEL, FoldingOrigami
from support.bench.rig import Rig
from support.bench.stand_in_motors import WAVELENGTH_MM


class Cams:
    """The cam shaft on the peristalsis board's motor; attributes as `StandInPeristalsis` has."""

    def __init__(self, board: emulated.EmulatedBoard) -> None:
        self._board = board
        turn = WAVELENGTH_MM * HALF_STEPS_PER_MM
        board.set_cam(turn, turn / 3, turn / 20)

    @property
    def cam_mm(self) -> float:
        """How far the cams have carried the wave."""
        return self._board.half_steps / HALF_STEPS_PER_MM

    @property
    def state(self) -> str:
        """Whether the motor is on."""
        return "running" if self._board.coils else "stopped"


class Thread:
    """The thread on the fold board's motor; `folded` is 0 or 1 where an end switch closes."""

    def __init__(self, board: emulated.EmulatedBoard) -> None:
        self.origami = FoldingOrigami(board)

    @property
    def folded(self) -> float:
        """How far the origami is folded, 0..1."""
        way = (self.origami.wound - SWITCH_TRAVEL) / (TRAVEL - 2 * SWITCH_TRAVEL)
        return min(max(way, 0.0), 1.0)


class EmulatedRig(Rig):
    """A `Rig` some of whose boards are no imitations.

    Parameters
    ----------
    folder : Path
        Where ports and sessions are.
    *real : str
        Which boards run their firmware: ``wave``, ``fold``.
    """

    # In less time than a motor needs for the way of a switch.
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
