"""The bench of a survey on boards: logger, peristalsis board and fold board, on a line each."""

import sys
from collections.abc import Mapping
from contextlib import ExitStack

import numpy as np

from capsule.bench.bench_errors import AcquisitionError, SurveyFaultError
from capsule.bench.board import MOST_RESETS, Board, connect
from capsule.bench.clock import AWAKE, StopRequest, elapsed_s
from capsule.bench.fold import FoldBoard
from capsule.bench.growing_file import FrameLog
from capsule.bench.logger import Logger
from capsule.bench.wave import LONGEST_PAUSE_S, Drive, Wave
from capsule.survey import cycle as cycles
from capsule.survey.survey_log import Readings

# Interval at which the lines are read while the survey waits for samples.
LOOK_EVERY_S = 0.02
# A sample that is later than this is missing: the survey does not wait for it.
LATE_S = 2.0


class BoardBench:
    """Three boards of `open_boards` as one bench, which waits `patience_s` for each."""

    def __init__(
        self,
        boards: Mapping[str, Board],
        wave: Wave,
        log: FrameLog,
        stop: StopRequest,
        patience_s: float,
    ) -> None:
        self._boards = boards
        self._logger = Logger(boards["logger"], log, to_end_stop=False)
        self._drive = Drive(boards["peristalsis"], wave, log, MOST_RESETS)
        self._fold = FoldBoard(boards["fold"], log)
        self._stop, self._patience_s = stop, patience_s
        self._read = 0
        # Samples that were not read yet.
        self._columns: list[tuple[float, ...] | None] = []

    @property
    def at_end(self) -> bool:
        """Return whether the capsule has closed the end stop."""
        return self._logger.at_end

    @property
    def trouble(self) -> AcquisitionError | None:
        """The fault that ends the survey; None if it can continue."""
        return (
            self._logger.trouble(self._patience_s)
            or self._fold.trouble(self._patience_s)
            or self._drive.trouble(self._patience_s)
        )

    @property
    def faults(self) -> list[str]:
        """What is wrong now and what to do; the survey goes on meanwhile."""
        away = [
            f"the {name} board was unplugged: plug it back in, or end the survey"
            for name in ("fold", "peristalsis")
            if not self._boards[name].connected
        ]
        return [fault for fault in (*away, self._logger.fault) if fault]

    @property
    def origami(self) -> str:
        """State of the origami, its thread and its motor, in words."""
        return self._fold.summary()

    @property
    def index_mm(self) -> float | None:
        """Phase of the wave at the cam shaft's index; None before the shaft has passed it."""
        return self._drive.phase.index_mm

    def resume(self, index_mm: float | None) -> None:
        """Trust the cam shaft's index alone, where the phase of the wave is this, if known."""
        self._drive.phase.index_mm = index_mm
        self._drive.phase.begin_anew()

    def tell(self, command: str) -> None:
        """Send the boards a command, and return at once."""
        if command == cycles.STOP_WAVE:
            self._drive.stop()
        elif command != cycles.FOLD or not self._stop.reason:
            self._fold.command(command)

    def read(self, samples: int) -> Readings | None:
        """Look at the boards; return the next samples once they are there, or late and missing.

        Raises
        ------
        KeyboardInterrupt
            Ctrl-C came before the first sample.
        AcquisitionError
            The first sample did not arrive, or the program was stopped so long that a lease may
            have ended.
        """
        paused_s = AWAKE.pause_s()
        if paused_s > LONGEST_PAUSE_S:
            raise AcquisitionError(
                f"this program was stopped for {paused_s:.0f} s, so the boards may have stopped "
                "the wave and unfolded the origami by themselves; look at the bench, then continue "
                "the session: capsule survey --resume"
            )
        if self._read == 0 and self._stop.reason:
            raise KeyboardInterrupt
        self._fold.serve()
        self._drive.serve()
        self._logger.serve(LOOK_EVERY_S)
        if self._read == 0 and (trouble := self.trouble):
            raise trouble
        return self._next(samples)

    def _next(self, samples: int) -> Readings | None:
        """Return the next samples if they have arrived, or the last of them is late."""
        new, state = self._logger.take(), self._logger.state
        # A sample that was late stays missing.
        late = self._read + len(self._columns) - (state.samples - len(new))
        self._columns += new[late:]
        # The times of the samples, past or future, by the computer's clock.
        behind = self._read + np.arange(samples) - (state.samples - 1)
        moments_s = self._logger.taken_s + behind * state.period_s
        is_late = state.samples > state.missing and elapsed_s() > moments_s[-1] + LATE_S
        if len(self._columns) < samples and not is_late:
            return None
        columns, self._columns = self._columns[:samples], self._columns[samples:]
        self._read += samples
        values = np.full((self._logger.sensors, samples), np.nan)
        for number, column in enumerate(columns):
            if column is not None:
                values[:, number] = column
        # Rounded as in the file: a resumed pilot must decide the same from the stored values.
        wave_mm = np.round(self._drive.phase.at(moments_s), 2)
        return Readings(values, wave_mm, self._fold.state)

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
        self._drive.set_up()
        self._drive.start()
        AWAKE.pause_s()  # what came before does not count

    def leave(self) -> None:
        """Stop the wave and unfold the origami, at any time; warn of a board that does not obey."""
        # Unfolding takes 12 s if the thread is stuck; the wave must not run on meanwhile.
        for leave in (self._drive.leave, self._fold.leave_unfolded):
            if warning := leave():
                print(warning, file=sys.stderr)
        self._boards["logger"].send("pause")


def open_boards(ports: Mapping[str, str | None], baud: int, at_end: ExitStack) -> dict[str, Board]:
    """Open the ports ``drive``, ``fold`` and ``logger``, and check which boards are behind them.

    A port that is None is searched for. The boards are returned as ``fold``, ``peristalsis`` and
    ``logger``; `at_end` closes them.

    Raises
    ------
    AcquisitionError
        A board is missing, or another one answers.
    """
    boards: dict[str, Board] = {}
    named = {"fold": ports["fold"], "peristalsis": ports["drive"], "logger": ports["logger"]}
    taken = [name for name in named.values() if name is not None]
    for wanted, port in named.items():
        boards[wanted] = connect(port, baud, wanted, print, taken)
        at_end.callback(boards[wanted].close)
    return boards
