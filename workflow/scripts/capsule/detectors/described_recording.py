"""Compute what the detectors need of a recording, when they ask for it.

Estimators of scikit-learn are fitted again for every fold, and get readings without names. So
`described` finds earlier results by the readings and the settings.
"""

import json
from collections.abc import Iterable, Mapping
from functools import cached_property, lru_cache

import numpy as np

from capsule.arrays import FloatArray
from capsule.detectors.described import read_scorer
from capsule.detectors.network import Features, Scorer, features_of
from capsule.detectors.registry import detector_row
from capsule.detectors.search import Passage, passage_of
from capsule.detectors.training import TrainingArchive
from capsule.detectors.wave_traits import WaveTraits, wave_traits
from capsule.kinds import Cells, Settings
from capsule.particle import Fit, Particle, fit_recording
from capsule.preprocessing import preprocess
from capsule.project import WEIGHTS
from capsule.seeding import readings_checksum
from capsule.templates import build_templates
from capsule.wave import missing_wave

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
        self._wave = (values, settings["recording"]["rate_hz"], settings["diagonal"])

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
        return missing_wave(*self._wave, self._settings["recording"]["wave_false_rate"])

    @cached_property
    def passage(self) -> Passage:
        """The recording's best candidate for a nodule."""
        return passage_of(*self._wave)

    @cached_property
    def features(self) -> Features:
        """The taught scorer's features of the recording."""
        return features_of(*self._wave, _shipped_scorer())

    @cached_property
    def traits(self) -> WaveTraits:
        """The traits of the recording's wave."""
        return wave_traits(*self._wave)

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


@lru_cache(maxsize=1)
def _shipped_scorer() -> Scorer:
    return read_scorer(WEIGHTS)


def training_archive(
    sizes_mm: Mapping[str, float],
    judged: Mapping[str, DescribedRecording],
    particles: Mapping[str, Particle],
    settings: Settings,
    detectors: Iterable[str],
    **more: Mapping[str, str],
) -> TrainingArchive:
    """Return what recordings teach some detectors, without what these do not use.

    Parameters
    ----------
    judged : mapping of str to DescribedRecording
        All recordings that can be judged, labelled or not.
    particles : mapping of str to Particle
        The fits of the recordings that teach the templates.
    detectors : iterable of str
        Their names.
    sizes_mm, settings, **more
        As in `TrainingArchive`.
    """
    rows = [detector_row(name) for name in detectors]
    by_features = any(row.by_features for row in rows)
    by_passages = not all(row.by_templates for row in rows)
    groups: dict[float, list[Particle]] = {}
    for name, particle in particles.items():
        groups.setdefault(sizes_mm[name], []).append(particle)
    return TrainingArchive(
        sizes_mm,
        build_templates(groups, **template_options(settings)),
        particles,
        {name: each.passage for name, each in judged.items()} if by_passages else {},
        lambda name: judged[name].matrix,
        settings,
        {name: each.features for name, each in judged.items()} if by_features else {},
        traits={name: each.traits for name, each in judged.items()},
        **more,
    )


def template_options(settings: Settings) -> Cells:
    """Return the arguments of `capsule.build_templates` except the particles."""
    return {
        "sensors": settings["recording"]["sensors"],
        "first_peak": settings["fit"]["first_peak"],
        "length": settings["preprocessing"]["length"],
    }
