"""The bench of a real survey: logger, peristalsis board and fold board, each on its own line."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from capsule.bench.bench_errors import AcquisitionError, SurveyFaultError
from capsule.bench.board_link import BoardLink, linked
from capsule.bench.boards import find
from capsule.bench.clock import PauseWatch
from capsule.bench.drive import Wave
from capsule.bench.fold_board import FoldBoard
from capsule.bench.frame_log import FrameLog
from capsule.bench.lease import LEASE_S
from capsule.bench.limits import StopRequest
from capsule.bench.line import BAUD
from capsule.bench.logger_feed import LoggerFeed
from capsule.bench.wave_drive import WaveDrive
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
    stop : StopRequest
        Request to stop, by Ctrl-C.
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
        stop: StopRequest,
        *,
        patience_s: float,
        begin_s: float = 0.0,
    ) -> None:
        self._logger, self._drive, self._fold, self._stop = logger, drive, fold, stop
        self._patience_s, self._begin_s = patience_s, begin_s
        self._read = 0
        self._left = False
        self._pauses = PauseWatch()

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
        elif command != cycles.FOLD or not self._stop.reason:
            self._fold.command(command)

    def _look_whether_it_goes_on(self) -> None:
        """Stop the wave at a request to stop; raise an error after a long pause.

        Raises
        ------
        AcquisitionError
            The program was stopped for so long that the boards' leases have ended.
        """
        if paused_s := self._pauses.paused_s():
            self._drive.note_pause()
            if paused_s > LEASE_S:
                raise AcquisitionError(
                    f"this program was stopped for {paused_s:.0f} s, and the boards have stopped "
                    "the wave and unfolded the origami by themselves; look at the bench, then "
                    "continue the session: capsule survey --resume"
                )
        if self._stop.reason:
            self._drive.stop()

    def read(self, samples: int) -> Readings:
        """Wait for the next samples; a late sample is missing.

        Raises
        ------
        KeyboardInterrupt
            Ctrl-C came before the first sample.
        AcquisitionError
            The first sample did not arrive, or the program was stopped for longer than the leases.
        """
        self._look_whether_it_goes_on()
        while (taken := self._logger.take(samples)) is None:
            self._look_whether_it_goes_on()
            if self._read == 0 and self._stop.reason:
                raise KeyboardInterrupt
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
        KeyboardInterrupt
            Ctrl-C came before the wave was started.
        """
        if warning := self._fold.leave_unfolded():
            raise SurveyFaultError(warning.removeprefix("warning: "))
        if self._stop.reason:
            raise KeyboardInterrupt
        self._drive.start()
        self._pauses = PauseWatch()

    def leave(self) -> list[str]:
        """Stop the wave, unfold the origami and close the ports; return warnings."""
        if self._left:
            return []
        self._left = True
        # Unfolding takes 12 s if the thread is stuck; the wave must not run on meanwhile.
        warnings = [self._drive.leave_stopped(), self._fold.leave_unfolded()]
        self._fold.close()
        self._logger.close()
        return [warning for warning in warnings if warning]


def board_links(
    ports: Ports, tell: Callable[[str], None], stop: StopRequest
) -> dict[str, BoardLink]:
    """Open all ports, and check which boards are behind them.

    Returns
    -------
    dict of str to BoardLink
        Links by the names ``fold``, ``peristalsis`` and ``logger``.

    Raises
    ------
    AcquisitionError
        A board is missing, or another one answers.
    KeyboardInterrupt
        Ctrl-C came before all boards were found.
    """
    links: dict[str, BoardLink] = {}

    def stopped() -> bool:
        return bool(stop.reason)

    def link(port: str, wanted: str) -> BoardLink:
        return linked(port, wanted, tell, ports.baud, stopped)

    try:
        links["fold"] = link(ports.fold, "fold")
        links["peristalsis"] = link(ports.drive, "peristalsis")
        if ports.logger is None:
            skip = [ports.drive, ports.fold]
            found = find("logger", ports.baud, tell, skip=skip, stopped=stopped)
            links["logger"] = BoardLink(*found, tell)
        else:
            links["logger"] = link(ports.logger, "logger")
        if stop.reason:
            raise KeyboardInterrupt
    except (AcquisitionError, KeyboardInterrupt):
        for each in links.values():
            each.close()
        raise
    return links


def board_bench(
    links: Mapping[str, BoardLink],
    wave: Wave,
    log: FrameLog,
    tell: Callable[[str], None],
    stop: StopRequest,
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
        stop,
        patience_s=patience_s,
        begin_s=begin_s,
    )
