"""What a recording or a survey shows while it runs: terminal and live page show the same state."""

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from capsule.arrays import plain
from capsule.judging.verdict import Judgement

KEPT = 600
# The terminal draws less than this share of the full scale as flat, and the remarks call it flat.
FLAT_SHARE = 0.01
# A sensor is weak if it swings less than this share of what the median sensor does.
_WEAK_SHARE = 0.25
# Fewer samples show no whole wave.
_LEAST_SAMPLES = 100


@dataclass
class State:
    """The state of a recording or a survey; the program writes it, terminal and page show it."""

    period_s: float  # between samples
    title: str = ""  # name of the recording or the survey
    full_scale: float = 1023.0  # the largest reading
    end_s: float = 0.0  # when the recording ends by itself; 0 if it does not
    longest: float = math.inf  # the workflow will reject a recording of more samples
    samples: int = 0  # so far, missing ones included
    missing: int = 0
    gaps: int = 0
    damaged: int = 0  # frames
    # The last samples; None is a missing one.
    recent: deque[tuple[float, ...] | None] = field(default_factory=lambda: deque(maxlen=KEPT))
    wave: str = ""  # its position and speed; empty without a peristalsis board
    faults: list[str] = field(default_factory=list)  # and what to do, the worst first
    judgement: Judgement | None = None  # what detectors say of the recording so far
    ended: str = ""  # why; empty while it goes on
    # Of a survey; the pilot's clock does not count the time for which it was interrupted.
    doing: str = ""  # what the capsule does; empty if this is no survey
    following: str = ""  # the next action
    origami: str = ""  # state of origami, thread and motor
    away_s: float = 0.0
    head_mm: float = math.nan  # last known position of the capsule's head
    head_known: bool = False  # whether this is the present position
    score: float = math.nan  # of the newest judgement; NaN if it had none
    threshold: float = math.nan
    length_mm: float = math.inf  # of the gut; infinite if unknown
    # Number, status (empty while undecided), position in mm and size in words of each place.
    places: Sequence[tuple[int, str, float, str]] = ()

    @property
    def time_s(self) -> float:
        """Time since the begin, interruptions included, in seconds."""
        return self.samples * self.period_s + self.away_s

    def add(self, sample: tuple[float, ...] | None) -> None:
        """Add the next sample; None is a missing one."""
        self.samples += 1
        if sample is None:
            self.missing += 1
            self.gaps += not self.recent or self.recent[-1] is not None
        self.recent.append(sample)

    def summary(self) -> str:
        """Return the state of a recording in one line."""
        now = _minutes(self.time_s)
        gaps = f"{self.gaps} gap{'' if self.gaps == 1 else 's'}"
        parts = [
            f"{now} of {_minutes(self.end_s)}" if self.end_s else now,
            f"{self.samples} samples",
            f"{gaps} ({self.missing} samples missing)" if self.gaps else "no gap",
            f"{self.damaged} damaged frames" if self.damaged else "",
            self.wave,
        ]
        return " | ".join(part for part in parts if part)

    def left(self) -> str:
        """Return in words how long the recording can go on."""
        limits = [f"{_minutes(max(self.end_s - self.time_s, 0))} left"] if self.end_s else []
        over_s = self.longest * self.period_s - self.time_s
        if over_s < 0:
            limits.append("too long for the workflow")
        elif math.isfinite(over_s):
            limits.append(f"{_minutes(over_s)} until it is too long for the workflow")
        return ", ".join(limits)

    def as_values(self) -> object:
        """Return what the live page shows besides the samples, as values of JSON."""
        judged = self.judgement
        values = vars(self) | {
            "time": _minutes(self.time_s),
            "left": self.left(),
            "remarks": self.remarks(),
            "advice": judged.advice if judged else "",
            "scores": judged.scores if judged else [],
        }
        del values["recent"], values["judgement"]
        return plain(values)

    def remarks(self) -> dict[int, str]:
        """Return which sensors, from 1, are flat or weak against the usual wave, with the remedy.

        A sensor swings from its 5th to its 95th percentile. The usual wave is the median swing of
        the sensors that are not flat.
        """
        known = np.array([sample for sample in self.recent if sample is not None], float)
        if len(known) < _LEAST_SAMPLES:
            return {}
        swing = np.subtract(*np.percentile(known, [95, 5], axis=0))
        flat = swing < FLAT_SHARE * self.full_scale
        usual = math.inf if flat.all() else float(np.median(swing[~flat]))
        remarks = {}
        for sensor, (is_flat, share) in enumerate(zip(flat, swing / usual, strict=True), start=1):
            if is_flat:
                remarks[sensor] = "flat: check its connection"
            elif share < _WEAK_SHARE:
                remarks[sensor] = f"weak: {100 * share:.0f} % of the usual wave; check its seat"
        return remarks


def _minutes(seconds: float) -> str:
    return f"{int(seconds // 60):02d}:{seconds % 60:04.1f}"
