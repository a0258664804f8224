"""The bench of a real survey: logger, peristalsis board and fold board, each on its own line."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from acquisition.bench_errors import AcquisitionError, SurveyFaultError
from acquisition.board_link import BoardLink, linked
from acquisition.boards import find
from acquisition.drive import Wave
from acquisition.fold_board import FoldBoard
from acquisition.frame_log import FrameLog
from acquisition.line import BAUD
from acquisition.logger_feed import LoggerFeed
from acquisition.wave_drive import WaveDrive
from capsule.survey import cycle as cycles
from capsule.survey.survey_log import Readings

# Interval at which the lines are read while the survey waits for samples.
LOOK_EVERY_S = 0.02


@dataclass(frozen=True)
class Ports:
    """The ports of the boards.

    Attributes
    ----------
    drive, fold : str
        Ports of the peristalsis board and of the fold board.
    logger : str or None
        Port of the logger; None: search for it.
    baud : int
        Bits per second.
    """

    drive: str
    fold: str
    logger: str | None = None
    baud: int = BAUD


class BoardBench:
    """Three boards as one bench.

    Parameters
    ----------
    logger, drive, fold
        The boards.
    patience_s : float
        Longest time in seconds without a board.
    begin_s : float
        Time of the first sample in seconds.
    """

    def __init__(
        self,
        logger: LoggerFeed,
        drive: WaveDrive,
        fold: FoldBoard,
        *,
        patience_s: float,
        begin_s: float = 0.0,
    ) -> None:
        self._logger, self._drive, self._fold = logger, drive, fold
        self._patience_s, self._begin_s = patience_s, begin_s
        self._read = 0
        self._left = False

    @property
    def at_end(self) -> bool:
        """Return whether the capsule has closed the end stop."""
        return self._logger.at_end

    @property
    def trouble(self) -> AcquisitionError | None:
        """The fault that ends the survey; None if it can continue."""
        for board in (self._logger, self._fold, self._drive):
            if trouble := board.trouble(self._patience_s):
                return trouble
        return None

    @property
    def index_mm(self) -> float | None:
        """Phase of the wave at the cam shaft's index."""
        return self._drive.index_mm

    def tell(self, command: str) -> None:
        """Send the boards a command, and return at once."""
        if command == cycles.STOP_WAVE:
            self._drive.stop()
        else:
            self._fold.command(command)

    def read(self, samples: int) -> Readings:
        """Wait for the next samples; a late sample is missing."""
        while (taken := self._logger.take(samples)) is None:
            self._fold.serve()
            self._drive.serve()
            self._logger.serve(LOOK_EVERY_S)
            if self._read == 0 and (trouble := self.trouble):
                raise trouble
        values, moments_s = taken
        numbers = self._read + np.arange(samples)
        self._read += samples
        # Rounded as in the file: a resumed pilot must decide the same from the stored values.
        time_s = np.round(self._begin_s + numbers / self._logger.rate_hz, 3)
        wave_mm = np.round(self._drive.wave_mm(moments_s), 2)
        return Readings(time_s, values, wave_mm, self._fold.state)

    def start(self) -> None:
        """Unfold the origami, and start the wave.

        Raises
        ------
        SurveyFaultError
            The origami does not unfold.
        AcquisitionError
            The wave does not start.
        """
        if warning := self._fold.leave_unfolded():
            raise SurveyFaultError(warning.removeprefix("warning: "))
        self._drive.start()

    def leave(self) -> list[str]:
        """Unfold the origami, stop the wave and close the ports; return warnings."""
        if self._left:
            return []
        self._left = True
        warnings = [self._fold.leave_unfolded(), self._drive.leave_stopped()]
        self._fold.close()
        self._logger.close()
        return [warning for warning in warnings if warning]


def board_links(ports: Ports, tell: Callable[[str], None]) -> dict[str, BoardLink]:
    """Open all ports, and check which boards are behind them.

    Returns
    -------
    dict of str to BoardLink
        Links by the names ``fold``, ``peristalsis`` and ``logger``.

    Raises
    ------
    AcquisitionError
        A board is missing, or another one answers.
    """
    links: dict[str, BoardLink] = {}
    try:
        links["fold"] = linked(ports.fold, "fold", tell, ports.baud)
        links["peristalsis"] = linked(ports.drive, "peristalsis", tell, ports.baud)
        if ports.logger is None:
            line = find("logger", ports.baud, tell, skip=[ports.drive, ports.fold])
            links["logger"] = BoardLink(*line, tell)
        else:
            links["logger"] = linked(ports.logger, "logger", tell, ports.baud)
    except AcquisitionError:
        for link in links.values():
            link.close()
        raise
    return links


def board_bench(
    links: Mapping[str, BoardLink],
    wave: Wave,
    log: FrameLog,
    tell: Callable[[str], None],
    *,
    patience_s: float,
    begin_s: float = 0.0,
    index_mm: float | None = None,
) -> BoardBench:
    """Return a bench of boards; parameters as in `BoardBench` and `WaveDrive`."""
    drive = WaveDrive(links["peristalsis"], wave, log, tell, index_mm=index_mm, resumed=begin_s > 0)
    return BoardBench(
        LoggerFeed(links["logger"], log, tell),
        drive,
        FoldBoard(links["fold"], log, tell),
        patience_s=patience_s,
        begin_s=begin_s,
    )
