"""The size of the nodule at a place, which the diagonal detector estimates from its passes."""

from collections.abc import Sequence

import numpy as np

from capsule.detectors.described_recording import DescribedRecording
from capsule.detectors.familiar import FAMILIAR, Familiarity, FamiliarKind
from capsule.detectors.shipped import Diagonal, size_features
from capsule.kinds import Settings


class PassSizes:
    """What the workflow has learned of sizes and of familiar recordings, for the passes of places.

    That is the content of detectors.json; if it is empty, or was learned with other settings,
    nothing is known of any place.
    """

    def __init__(self, learned: Settings, detector: Settings, rate_hz: float) -> None:
        self._settings = {"recording": {"rate_hz": rate_hz}, "diagonal": detector}
        # A model learned with other settings does not fit the features of these passes.
        same = learned.get("settings", {}).get("diagonal") == dict(detector) and FAMILIAR in learned
        self._sizes = Diagonal.restored(learned).sizes if same else None
        self._familiar = FamiliarKind.restored(learned[FAMILIAR]) if same else None

    def of(self, passes: Sequence[np.ndarray]) -> tuple[float, float, float]:
        """Return a size and the ends of its interval, in mm; NaN if unknown.

        Parameters
        ----------
        passes : sequence of (S, K) arrays
            Readings of the passes over one place. The size is the mean over them. More passes do
            not narrow its interval: the nodule's height against the capsule is the same in all.
        """
        described = [DescribedRecording(values, self._settings) for values in passes]
        found = [each.passage for each in described] if self._sizes else []
        features = [size_features(passage) for passage in found if not np.isnan(passage.evidence)]
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
