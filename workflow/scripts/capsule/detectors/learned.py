"""What the detectors have learned from an archive, to judge a new recording without the archive."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass

import numpy as np

from capsule.detectors.diagonal import DiagonalModel
from capsule.detectors.operating_point import Probability
from capsule.detectors.search import search
from capsule.detectors.sizing import SizeModel
from capsule.detectors.template import judge_matrix
from capsule.detectors.verdicts import Verdict


@dataclass(frozen=True)
class Learned:
    """What all labelled recordings of an archive teach.

    Attributes
    ----------
    recordings : int
        How many they are.
    margin_threshold : float
        Of the paper's margin; NaN without a recording without a nodule.
    diagonal : DiagonalModel
        Of the diagonal detector.
    """

    recordings: int
    margin_threshold: float
    diagonal: DiagonalModel

    def verdicts(
        self,
        matrix: np.ndarray,
        values: np.ndarray,
        templates: Mapping[float, np.ndarray],
        *,
        first_peak: int,
        rate_hz: float,
        diagonal: Mapping,
    ) -> dict[str, Verdict]:
        """Judge one recording.

        Parameters
        ----------
        matrix : (S, L) array
            V.
        values : (S, K) array
            Readings on an even grid in time; NaN where a sample is missing.
        templates : mapping of float to (S, L) array
            The template of every size, that of 0 first.
        first_peak : int
            u.
        rate_hz : float
            Sampling rate.
        diagonal : mapping
            Section ``diagonal`` of the configuration.

        Returns
        -------
        dict of str to Verdict
            By detector.
        """
        sizes_mm, matrices = tuple(templates), tuple(templates.values())
        _, by_rule, by_threshold = judge_matrix(
            matrix, matrices, sizes_mm, first_peak, self.margin_threshold
        )
        return {
            "template": by_rule,
            "template_threshold": by_threshold,
            "diagonal": self.diagonal.verdict(search(values, rate_hz, diagonal)),
        }


def to_json(learned: Learned) -> dict:
    """Give it as JSON holds it: NaN becomes null, arrays become lists."""
    return _plain(asdict(learned))


def from_json(content: Mapping) -> Learned:
    """Take it out of what `to_json` gave.

    Raises
    ------
    KeyError, TypeError
        The content is of another version.
    """
    model = dict(content["diagonal"])
    sizes, probability = model["sizes"], model["probability"]
    if sizes is not None:
        arrays = {name: np.array(sizes[name]) for name in ("mean", "scale", "coefficients")}
        model["sizes"] = SizeModel(**{**sizes, **arrays})
    if probability is not None:
        model["probability"] = Probability(**probability)
    model["threshold"] = _number(model["threshold"])
    model["known_mm"] = tuple(model["known_mm"])
    margin = _number(content["margin_threshold"])
    return Learned(content["recordings"], margin, DiagonalModel(**model))


def _number(value: float | None) -> float:
    return float("nan") if value is None else float(value)


def _plain(value: object) -> object:
    if isinstance(value, Mapping):
        return {key: _plain(part) for key, part in value.items()}
    if isinstance(value, np.ndarray | tuple | list):
        return [_plain(part) for part in value]
    if isinstance(value, float | np.floating):
        return None if np.isnan(value) else float(value)
    return value
