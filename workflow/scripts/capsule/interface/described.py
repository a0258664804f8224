"""What the detectors judge a recording by, made of its readings and kept for the next fold.

Estimators of scikit-learn are fitted anew for every fold, and see readings without names: by their
checksum, what was made of the same readings under the same settings is found again.
"""

import json
from functools import lru_cache

import numpy as np

from capsule.arrays import BoolArray
from capsule.detectors.passage import Passage, passage_of
from capsule.detectors.scorer import Features, Scorer, features_of
from capsule.fitting import Fit, fit_recording
from capsule.interface.reading_side import import_reader
from capsule.kinds import Cells, Settings
from capsule.preprocessing import preprocess
from capsule.seeding import readings_checksum
from capsule.wave_check import missing_wave

# More than an archive holds that is judged on one machine; a recording takes some 60 kB.
_KEPT = 4096


class DescribedRecording:
    """The readings of one recording, and what the detectors see of them.

    Parameters
    ----------
    values : (S, K) array
        Readings on an even grid in time; NaN where a sample is missing.
    settings : JudgingSettings
        What decides how it is seen.

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
        """Why no detector judges it; empty where each sensor shows a wave."""
        window = self._settings.all["preprocessing"]["window"]
        if self.values.shape[1] < window:
            return f"{self.values.shape[1]} samples are fewer than the window of {window}"
        if not _varies(self.values).all():
            return f"sensor_{int(np.argmin(_varies(self.values))) + 1} is constant or missing"
        return _no_wave(self._key("recording", "diagonal"))

    @property
    def passage(self) -> Passage:
        """Its best candidate for a nodule."""
        return _passage(self._key("recording", "diagonal"))

    @property
    def features(self) -> Features:
        """What the taught scorer makes of it."""
        return _features(self._key("recording", "diagonal"))

    @property
    def fit(self) -> Fit:
        """The particle that is most similar to it; some 0.2 s when it is asked for first."""
        return _fit(self._key("preprocessing", "fit"))

    def _key(self, *sections: str) -> "_Key":
        return _Key(self, self._settings.text(sections))


class JudgingSettings:
    """The configuration, and sections of it as text, by which equal ones are found again.

    Parameters
    ----------
    settings : mapping
        The configuration.
    """

    def __init__(self, settings: Settings) -> None:
        self.all = settings
        self._texts: dict[tuple[str, ...], str] = {}

    def text(self, sections: tuple[str, ...]) -> str:
        """Write some sections as JSON."""
        if sections not in self._texts:
            chosen = {name: self.all[name] for name in sections}
            self._texts[sections] = json.dumps(chosen, sort_keys=True)
        return self._texts[sections]


def _varies(values: np.ndarray) -> BoolArray:
    """Tell which sensors vary, (S,) of bool."""
    known = np.where(np.isnan(values), -np.inf, values).max(axis=1)
    varies: BoolArray = known > np.where(np.isnan(values), np.inf, values).min(axis=1)
    return varies


class _Key:
    """Readings under settings; equal where the same numbers follow from both."""

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
    # All who ask get the same array.
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
def _features(key: _Key) -> Features:
    rate_hz = key.settings["recording"]["rate_hz"]
    return features_of(key.values, rate_hz, key.settings["diagonal"], shipped_scorer())


@lru_cache(maxsize=_KEPT)
def _fit(key: _Key) -> Fit:
    return fit_recording(key.recording.matrix, key.values, key.settings["fit"])


@lru_cache(maxsize=1)
def shipped_scorer() -> Scorer:
    """Read the taught scorer that ships with the project."""
    scorer: Scorer = import_reader("library").read_shipped_scorer()
    return scorer


@lru_cache(maxsize=1)
def _shipped_settings() -> str:
    return json.dumps(import_reader("library").read_settings())


def shipped_settings() -> Cells:
    """Read the configuration that ships with the project."""
    settings: Cells = json.loads(_shipped_settings())
    return settings
