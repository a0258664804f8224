"""Compute what the detectors need of a recording, and cache it for the next fold.

Estimators of scikit-learn are fitted again for every fold, and get readings without names. So the
cache finds earlier results by the checksum of the readings and by the settings.
"""

import json
from functools import lru_cache

import numpy as np

from capsule.arrays import BoolArray
from capsule.detectors.described import read_scorer
from capsule.detectors.network import Features, Scorer, features_of
from capsule.detectors.search import Passage, passage_of
from capsule.detectors.wave_traits import WaveTraits, wave_traits
from capsule.fitting import Fit, fit_recording
from capsule.kinds import Cells, Settings
from capsule.preprocessing import preprocess
from capsule.project import WEIGHTS
from capsule.seeding import readings_checksum
from capsule.wave_check import missing_wave

# More recordings than an archive on one machine has; each takes some 60 kB.
_KEPT = 4096


class DescribedRecording:
    """The readings of one recording, and the detectors' view of them.

    Parameters
    ----------
    values : (S, K) array
        Readings on an even grid in time; NaN where a sample is missing.
    settings : JudgingSettings
        The configuration.

    Attributes
    ----------
    name : str
        The checksum of the readings.
    """

    def __init__(self, values: np.ndarray, settings: "JudgingSettings") -> None:
        self.values, self._settings = values, settings
        self.name = readings_checksum(values)

    @property
    def matrix(self) -> np.ndarray:
        """V, (S, L)."""
        return _matrix(self._key("preprocessing"))

    @property
    def no_verdict(self) -> str:
        """Why no detector judges the recording; empty if each sensor shows a wave."""
        window = self._settings.all["preprocessing"]["window"]
        if self.values.shape[1] < window:
            return f"{self.values.shape[1]} samples are fewer than the window of {window}"
        if not _varies(self.values).all():
            return f"sensor_{int(np.argmin(_varies(self.values))) + 1} is constant or missing"
        return _no_wave(self._key("recording", "diagonal"))

    @property
    def passage(self) -> Passage:
        """The recording's best candidate for a nodule."""
        return _passage(self._key("recording", "diagonal"))

    @property
    def features(self) -> Features:
        """The taught scorer's features of the recording."""
        return _features(self._key("recording", "diagonal"))

    @property
    def traits(self) -> WaveTraits:
        """The traits of the recording's wave."""
        return _traits(self._key("recording", "diagonal"))

    @property
    def fit(self) -> Fit:
        """The particle that is most similar to the recording; the first access takes some 0.2 s."""
        return _fit(self._key("preprocessing", "fit"))

    def _key(self, *sections: str) -> "_Key":
        return _Key(self, self._settings.text(sections))


class JudgingSettings:
    """The configuration, with its sections as text, which serves as the key of a cache.

    Parameters
    ----------
    settings : mapping
        The configuration.
    """

    def __init__(self, settings: Settings) -> None:
        self.all = settings
        self._texts: dict[tuple[str, ...], str] = {}

    def text(self, sections: tuple[str, ...]) -> str:
        """Return some sections as JSON."""
        if sections not in self._texts:
            chosen = {name: self.all[name] for name in sections}
            self._texts[sections] = json.dumps(chosen, sort_keys=True)
        return self._texts[sections]


def _varies(values: np.ndarray) -> BoolArray:
    """Return whether each sensor varies, (S,) of bool."""
    known = np.where(np.isnan(values), -np.inf, values).max(axis=1)
    varies: BoolArray = known > np.where(np.isnan(values), np.inf, values).min(axis=1)
    return varies


class _Key:
    """Readings with settings; two keys are equal if they lead to the same results."""

    def __init__(self, recording: DescribedRecording, settings: str) -> None:
        self.recording, self._same = recording, (recording.name, settings)

    def __hash__(self) -> int:
        return hash(self._same)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Key) and self._same == other._same

    @property
    def values(self) -> np.ndarray:
        return self.recording.values

    @property
    def settings(self) -> Cells:
        settings: Cells = json.loads(self._same[1])
        return settings


@lru_cache(maxsize=_KEPT)
def _matrix(key: _Key) -> np.ndarray:
    matrix = preprocess(key.values, **key.settings["preprocessing"])
    # All callers share this array.
    matrix.flags.writeable = False
    return matrix


@lru_cache(maxsize=_KEPT)
def _no_wave(key: _Key) -> str:
    rules = key.settings["recording"]
    return missing_wave(
        key.values, rules["rate_hz"], key.settings["diagonal"], rules["wave_false_rate"]
    )


@lru_cache(maxsize=_KEPT)
def _passage(key: _Key) -> Passage:
    return passage_of(key.values, key.settings["recording"]["rate_hz"], key.settings["diagonal"])


@lru_cache(maxsize=_KEPT)
def _traits(key: _Key) -> WaveTraits:
    return wave_traits(key.values, key.settings["recording"]["rate_hz"], key.settings["diagonal"])


@lru_cache(maxsize=_KEPT)
def _features(key: _Key) -> Features:
    rate_hz = key.settings["recording"]["rate_hz"]
    return features_of(key.values, rate_hz, key.settings["diagonal"], shipped_scorer())


@lru_cache(maxsize=_KEPT)
def _fit(key: _Key) -> Fit:
    return fit_recording(key.recording.matrix, key.values, key.settings["fit"])


@lru_cache(maxsize=1)
def shipped_scorer() -> Scorer:
    """Read the taught scorer that ships with the project."""
    return read_scorer(WEIGHTS)
