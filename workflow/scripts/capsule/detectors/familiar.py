"""Distinguish recordings of the kind that taught the detectors from others.

The recordings that teach the detectors also teach what is familiar: how far each of them deviates,
in its `WaveTraits`, from the recordings at the other places. A recording is unfamiliar if it
deviates farther than the rank of their deviations allows, as for all thresholds.
"""

import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from capsule.arrays import FloatArray, IntArray, plain
from capsule.detectors.base import JudgedRecording, TrainingArchive
from capsule.detectors.calibrate import upper_quantile
from capsule.detectors.wave_traits import WaveTraits, log_odds
from capsule.kinds import Cells, Settings

# The nominal rate at which recordings of the familiar kind are called unfamiliar, and the number of
# places from which on a rank can show so small a rate.
NOMINAL_RATE = 0.02
LEAST_PLACES = math.ceil(1 / NOMINAL_RATE) - 1
# A smaller deviation does not matter, however rare it is: a larger nodule than those that teach
# moves the traits a little. In spreads of the recordings that teach.
_LEAST_DEVIATION = 3.0
# The arrays of what is familiar, in its order.
_ARRAYS = ("centre", "spread", "least", "most")
# The key of what is familiar in results/detectors.json.
FAMILIAR = "familiar"
# Why nobody can tell whether a recording is familiar: too few places teach, or it has no wave.
TOO_FEW, NO_WAVE = "too_few_places", "no_wave"
_FIELDS = [each.name for each in fields(WaveTraits)]
# Smaller spreads of the traits, on the scale of `_scaled`, do not matter. Seven simulated benches
# and two others tell: nodules of 4 and 5 mm move the traits by less than three of these.
_LEAST_SPREADS = (0.03, 0.003, 0.4, 0.35, 1.0, 0.2)


@dataclass(frozen=True)
class Familiarity:
    """The answer whether a recording is familiar; `capsule.detectors.unlike` says it in words.

    Attributes
    ----------
    familiar : bool or None
        None if nobody can tell.
    traits : tuple of str
        The fields of `WaveTraits` that deviate, that which deviates most first. If nobody can tell,
        `TOO_FEW` or `NO_WAVE` stands in their place, or nothing if no detector judges.
    value, least, most : float
        The first trait, and its range in the recordings that teach. For `TOO_FEW`, the number of
        places that teach, and how many are needed.
    """

    familiar: bool | None
    traits: tuple[str, ...] = ()
    value: float = math.nan
    least: float = math.nan
    most: float = math.nan

    def stated(self, probability: float) -> float:
        """Return a verdict's probability, NaN for an unfamiliar recording, of which none holds."""
        return float("nan") if self.familiar is False else probability

    @property
    def cells(self) -> Cells:
        """The columns of a table of verdicts: ``familiar``, ``unfamiliar_because``, ..."""
        answer = {True: "yes", False: "no", None: ""}[self.familiar]
        ends = {"unlike_least": self.least, "unlike_most": self.most}
        told = {"unfamiliar_because": " ".join(self.traits), "unlike_value": self.value}
        return {"familiar": answer, **told, **ends}


@dataclass(frozen=True)
class FamiliarKind:
    """The traits of familiar recordings.

    Attributes
    ----------
    places : int
        Number of places that teach.
    limit : float
        A recording whose largest deviation is above it, in spreads, is not familiar.
    centre, spread : (T,) array
        Mean, and standard deviation or smallest spread, of each trait over the recordings that
        teach, on the scale of `_scaled`.
    least, most : (T,) array
        Range of each trait over the recordings that teach; NaN for one that they do not have.
    """

    places: int
    limit: float
    centre: FloatArray
    spread: FloatArray
    least: FloatArray
    most: FloatArray

    def judge(self, traits: WaveTraits) -> Familiarity:
        """Judge a recording by its traits."""
        return self.judge_all([traits])[0]

    def judge_all(self, traits: Sequence[WaveTraits]) -> list[Familiarity]:
        """Judge recordings by their traits, each by itself."""
        if self.places < LEAST_PLACES:
            few = Familiarity(None, (TOO_FEW,), float(self.places), float(LEAST_PLACES))
            return [few] * len(traits)
        known, own = ~np.isnan(self.least), _rows_of(traits)
        wave = ~np.isnan(own[:, known]).any(axis=1)
        answers = [Familiarity(None, (NO_WAVE,))] * len(traits)
        deviations = np.abs(_scaled(own[wave]) - self.centre) / self.spread
        deviations = np.where(known, deviations, -np.inf)
        for number, own_deviations in zip(np.flatnonzero(wave).tolist(), deviations, strict=True):
            answers[number] = (
                Familiarity(True)
                if own_deviations.max() <= self.limit
                else self._unlike(own[number], own_deviations)
            )
        return answers

    def _unlike(self, own: FloatArray, deviations: FloatArray) -> Familiarity:
        far = np.flatnonzero(deviations > _LEAST_DEVIATION)
        order = far[np.argsort(-deviations[far], kind="stable")].tolist()
        ends = (float(each[order[0]]) for each in (own, self.least, self.most))
        return Familiarity(False, tuple(_FIELDS[number] for number in order), *ends)

    @classmethod
    def taught(cls, archive: TrainingArchive, left_out: Collection[str] = ()) -> "FamiliarKind":
        """Learn from all labelled recordings of an archive except those left out."""
        traits, _, places = archive.teaching(_traits_of, left_out)
        return learn_familiar(traits, places)

    def stored(self) -> dict[str, Any]:
        """Return the values in a form that JSON can store; NaN becomes None."""
        return {name: plain(value) for name, value in vars(self).items()}

    @classmethod
    def restored(cls, stored: Settings) -> "FamiliarKind":
        """Return what `stored` has returned."""
        arrays = {name: np.array(stored[name], np.float64) for name in _ARRAYS}
        limit = stored["limit"]
        return cls(stored["places"], np.inf if limit is None else limit, **arrays)


def _traits_of(recording: JudgedRecording) -> FloatArray:
    row: FloatArray = _rows_of([recording.traits])[0]
    return row


def _rows_of(traits: Sequence[WaveTraits]) -> FloatArray:
    """Return the fields of traits as rows, (n, T)."""
    # `dataclasses.astuple` copies each value, which takes ten times as long.
    return np.array([list(vars(each).values()) for each in traits]).reshape(-1, len(_FIELDS))


def learn_familiar(traits: FloatArray, places: IntArray) -> FamiliarKind:
    """Learn what is familiar from the fields of `WaveTraits`, (n, T), and the places, (n,).

    The limit is the `upper_quantile` of the largest deviations of the recordings that teach, each
    from those of the other places. What fewer than `LEAST_PLACES` places teach can tell of no
    recording.
    """
    count = np.unique(places).size
    if count < LEAST_PLACES:
        return FamiliarKind(count, np.inf, *[np.empty(0)] * len(_ARRAYS))
    missing = np.isnan(traits).any(axis=0)
    scaled = np.where(missing, 0.0, _scaled(traits))
    centre, spread = _without_each(scaled, places)
    deviations = np.abs(scaled - centre) / spread
    limit = upper_quantile(deviations[:, ~missing].max(axis=1), places, 1 - NOMINAL_RATE)
    return FamiliarKind(
        count,
        max(limit, _LEAST_DEVIATION),
        scaled.mean(axis=0),
        np.maximum(scaled.std(axis=0, ddof=1), _LEAST_SPREADS),
        np.where(missing, np.nan, traits.min(axis=0)),
        np.where(missing, np.nan, traits.max(axis=0)),
    )


def _without_each(scaled: FloatArray, places: IntArray) -> tuple[FloatArray, FloatArray]:
    """Return mean and spread of the traits over the recordings of other places, (n, T)."""
    middle = scaled.mean(axis=0)
    off = scaled - middle
    own = np.array([np.bincount(places, each)[places] for each in (*off.T, *(off**2).T)])
    sums, squares = (-half.T for half in np.split(own, 2))
    count = (places.size - np.bincount(places)[places])[:, np.newaxis]
    mean = sums / count
    variance = ((off**2).sum(axis=0) + squares - count * mean**2) / (count - 1)
    spread = np.sqrt(np.maximum(variance, 0.0))
    return middle + mean, np.maximum(spread, _LEAST_SPREADS)


def _scaled(traits: FloatArray) -> FloatArray:
    """Return traits (n, T) on scales on which their deviations are alike in both directions.

    Times from sensor to sensor count in periods. What cannot fall below 0 is a logarithm, the share
    is a logit; a small number added to a spread keeps the logarithm of one near 0 finite.
    """
    period, step, step_spread, unsteadiness, share, noise = traits.T
    scaled: FloatArray = np.stack(
        [
            np.log(period),
            step / period,
            np.log(step_spread / period + 0.003),
            np.log(unsteadiness + 0.002),
            log_odds(share),
            np.log(np.maximum(noise, 1e-6)),
        ],
        axis=1,
    )
    return scaled
