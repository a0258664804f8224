"""The size of the nodule at a place, which the diagonal detector estimates from its passes."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from capsule.detectors.described_recording import DescribedRecording
from capsule.detectors.diagonal import Diagonal, size_features
from capsule.detectors.familiar import FAMILIAR, Familiarity, FamiliarKind
from capsule.detectors.files import read_learned
from capsule.kinds import Settings
from capsule.store.results import OfArchive


class PassSizes:
    """What the workflow has learned of sizes and of familiar recordings, for the passes of places.

    Without it, or if it was learned with other settings, nothing is known of any place.
    """

    def __init__(self, results: Path, detector: Settings, rate_hz: float) -> None:
        self._settings = {"recording": {"rate_hz": rate_hz}, "diagonal": detector}
        path = results / OfArchive.DETECTORS
        content = read_learned(path) if path.exists() else {}
        # A model learned with other settings does not fit the features of these passes.
        same = content.get("settings", {}).get("diagonal") == dict(detector) and FAMILIAR in content
        self._sizes = Diagonal.restored(content).sizes if same else None
        self._familiar = FamiliarKind.restored(content[FAMILIAR]) if same else None

    def of(self, passes: Sequence[np.ndarray]) -> tuple[float, float, float]:
        """Return a size and the ends of its interval, in mm; NaN if unknown.

        Parameters
        ----------
        passes : sequence of (S, K) arrays
            Readings of the passes over one place. The size is the mean over them. More passes do
            not narrow its interval: the nodule's height against the capsule is the same in all.
        """
        features = []
        for values in passes if self._sizes else ():
            passage = DescribedRecording(values, self._settings).passage
            if not np.isnan(passage.evidence):
                features.append(size_features(passage))
        if self._sizes is None or not features:
            return np.nan, np.nan, np.nan
        size_mm = float(np.mean(self._sizes.estimate(np.array(features))))
        return size_mm, *self._sizes.interval(size_mm)

    def familiarity(self, passes: Sequence[np.ndarray]) -> Familiarity:
        """Return whether all passes over a place are familiar; else why the first is not."""
        if self._familiar is None:
            return Familiarity(None)
        traits = [DescribedRecording(values, self._settings).traits for values in passes]
        found = self._familiar.judge_all(traits)
        # False comes first, then None.
        order = [False, None, True]
        return min(found, key=lambda each: order.index(each.familiar), default=Familiarity(None))
