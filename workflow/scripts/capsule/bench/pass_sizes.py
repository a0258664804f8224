"""The size of the nodule at a place, which the diagonal detector estimates from its passes."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from capsule.detectors.diagonal import Diagonal, size_features
from capsule.detectors.familiar import FAMILIAR, Familiarity, FamiliarKind
from capsule.detectors.files import read_learned
from capsule.detectors.search import passage_of
from capsule.detectors.wave import Wave, wave_of
from capsule.detectors.wave_traits import wave_traits
from capsule.kinds import Settings
from capsule.store.results import OfArchive

_UNKNOWN = float("nan")


class PassSizes:
    """An estimator of nodule sizes from passes; without a learned model, all sizes are NaN.

    A model that was learned with other settings is not used.
    """

    def __init__(self, results: Path, detector: Settings, rate_hz: float) -> None:
        self._detector, self._rate_hz = detector, rate_hz
        self._model: Diagonal | None = None
        self._familiar: FamiliarKind | None = None
        path = results / OfArchive.DETECTORS
        content = read_learned(path) if path.exists() else {}
        # A model learned with other settings does not fit the features of these passes.
        same = content.get("settings", {}).get("diagonal") == dict(detector)
        if same and FAMILIAR in content:
            self._model = Diagonal.restored(content)
            self._familiar = FamiliarKind.restored(content[FAMILIAR])

    def _wave(self, values: np.ndarray) -> Wave | None:
        return wave_of(values, self._rate_hz, self._detector)

    def of(self, passes: Sequence[np.ndarray]) -> tuple[float, float, float]:
        """Return a size and the ends of its interval, in mm; NaN if unknown.

        Parameters
        ----------
        passes : sequence of (S, K) arrays
            Readings of the passes over one place. The size is the mean over them. More passes do
            not narrow its interval: the nodule's height against the capsule is the same in all.
        """
        if self._model is None or self._model.sizes is None:
            return _UNKNOWN, _UNKNOWN, _UNKNOWN
        found = [passage_of(self._wave(values), self._detector) for values in passes]
        known = [passage for passage in found if not np.isnan(passage.evidence)]
        if not known:
            return _UNKNOWN, _UNKNOWN, _UNKNOWN
        features = np.array([size_features(passage) for passage in known])
        size_mm = float(np.mean(self._model.sizes.estimate(features)))
        return size_mm, *self._model.sizes.interval(size_mm)

    def familiarity(self, passes: Sequence[np.ndarray]) -> Familiarity:
        """Return whether all passes over a place are familiar; else why the first is not."""
        if self._familiar is None:
            return Familiarity(None)
        found = [
            self._familiar.judge(wave_traits(self._wave(values), self._rate_hz))
            for values in passes
        ]
        # False comes first, then None.
        order = [False, None, True]
        return min(found, key=lambda each: order.index(each.familiar), default=Familiarity(None))
