"""Compute what the detectors need of a recording, when they ask for it.

Estimators of scikit-learn are fitted again for every fold, and get readings without names. So
`described` finds earlier results by the readings and the settings.
"""

import json
from collections.abc import Iterable
from functools import cached_property, lru_cache

import numpy as np

from capsule.arrays import FloatArray
from capsule.detectors.described import read_scorer
from capsule.detectors.network import Features
from capsule.detectors.search import Passage, passage_of, series_of
from capsule.detectors.wave import Wave, missing_wave, wave_of
from capsule.detectors.wave_traits import WaveTraits, wave_traits
from capsule.engine.project import WEIGHTS
from capsule.kinds import Settings
from capsule.method.particle import Fit, fit_recording
from capsule.method.preprocessing import preprocess
from capsule.seeding import readings_checksum

# More recordings than an archive on one machine has; each takes some 60 kB.
_KEPT = 4096


class DescribedRecording:
    """The detectors' view of a recording.

    Parameters
    ----------
    values : (S, K) array
        Readings on an even grid in time; NaN where a sample is missing. Their checksum is the name.
    settings : mapping
        The configuration.
    """

    def __init__(self, values: FloatArray, settings: Settings) -> None:
        self.values, self._settings = values, settings
        self.name = readings_checksum(values)
        self._rate_hz, self._bench = settings["recording"]["rate_hz"], settings["diagonal"]

    @cached_property
    def _wave(self) -> Wave | None:
        return wave_of(self.values, self._rate_hz, self._bench)

    @cached_property
    def matrix(self) -> FloatArray:
        """Matrix V, (S, L)."""
        matrix = preprocess(self.values, **self._settings["preprocessing"])
        # All callers share this array.
        matrix.flags.writeable = False
        return matrix

    @cached_property
    def no_verdict(self) -> str:
        """Why no detector judges the recording; empty if each sensor shows a wave."""
        samples, window = self.values.shape[1], self._settings["preprocessing"]["window"]
        if samples < window:
            return f"{samples} samples are fewer than the window of {window}"
        for sensor, row in enumerate(self.values, start=1):
            if np.unique(row[~np.isnan(row)]).size < 2:
                return f"sensor_{sensor} is constant or missing"
        false_rate = self._settings["recording"]["wave_false_rate"]
        return missing_wave(self._wave, self._bench, false_rate)

    @cached_property
    def passage(self) -> Passage:
        """The recording's best candidate for a nodule."""
        return passage_of(self._wave, self._bench)

    @cached_property
    def features(self) -> Features:
        """The taught scorer's features of the recording."""
        return read_scorer(WEIGHTS).features(series_of(self._wave))

    @cached_property
    def traits(self) -> WaveTraits:
        """The traits of the recording's wave."""
        return wave_traits(self._wave, self._rate_hz)

    @cached_property
    def fit(self) -> Fit:
        """The particle that is most similar to the recording; it takes some 0.2 s."""
        return fit_recording(self.matrix, self.values, self._settings["fit"])


def described(readings: Iterable[FloatArray], settings: Settings) -> list[DescribedRecording]:
    """Return the detectors' view of the readings (S, K) of some recordings."""
    used = {name: settings[name] for name in ("recording", "preprocessing", "fit", "diagonal")}
    text = json.dumps(used, sort_keys=True)
    return [_described(values.tobytes(), len(values), text) for values in readings]


@lru_cache(maxsize=_KEPT)
def _described(content: bytes, sensors: int, settings: str) -> DescribedRecording:
    values = np.frombuffer(content).reshape(sensors, -1).copy()
    return DescribedRecording(values, json.loads(settings))
