"""The passage of a nodule: the place and speed at which the beats of all sensors agree on it."""

from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from capsule.arrays import FloatArray
from capsule.detectors.beats import Beats, find_beats
from capsule.detectors.candidates import averages, try_candidates
from capsule.divider import pressed_and_period
from capsule.kinds import Settings

# Keys of section ``diagonal`` that serve the beats or the learning, not the search for a passage.
_OF_NO_SEARCH = {"wave_speed_mm_s", "wavelength_mm", "full_scale", "pressing_lowers_reading"}
_OF_NO_SEARCH |= {"size_ridge"}


@dataclass(frozen=True)
class Passage:
    """The best candidate for a nodule in one recording.

    Attributes
    ----------
    evidence : float
        Excess of the weighted beats over the usual ones, in units of their spread, averaged over
        the sensors. This is the detector's score.
    level, depth, shape : float
        The channels at the candidate, averaged over the sensors, in usual depths.
    location_mm : float
        Way of the first sensor from the recording's start to the candidate, in mm.
    location_samples : float
        Time at which the first sensor passes it, in samples from the recording's start.
    lag_samples : float
        Mean time from sensor to sensor, in samples.
    level_spread, depth_spread, shape_spread : float
        Standard deviation of the channels over the whole run, averaged over the sensors, in usual
        depths. They do not depend on the place, but help to estimate the size.
    """

    evidence: float
    level: float
    depth: float
    shape: float
    location_mm: float
    location_samples: float
    lag_samples: float
    level_spread: float
    depth_spread: float
    shape_spread: float


UNKNOWN = Passage(*[float("nan")] * len(fields(Passage)))


def passage_of(values: FloatArray, rate_hz: float, settings: Settings) -> Passage:
    """Return the best candidate for a nodule in one recording.

    Parameters
    ----------
    values : (S, K) array
        Readings on an even grid in time; NaN where a sample is missing.
    rate_hz : float
        Sampling rate.
    settings : mapping
        Section ``diagonal`` of the configuration.

    Returns
    -------
    Passage
        `UNKNOWN` if a sensor shows no peristaltic wave.
    """
    beats, options = beats_of(values, rate_hz, settings)
    return UNKNOWN if beats is None else find_passage(beats, **options)


def beats_of(
    values: FloatArray, rate_hz: float, settings: Settings
) -> tuple[Beats | None, dict[str, Any]]:
    """Return the beats of a recording, and the settings of the search for a passage in them.

    For the parameters see `passage_of`; for None see `find_beats`.
    """
    pressed, period = pressed_and_period(values, rate_hz, settings)
    options = {key: value for key, value in settings.items() if key not in _OF_NO_SEARCH}
    return find_beats(pressed, period=period, wavelength_mm=settings["wavelength_mm"]), options


def find_passage(beats: Beats, **settings: Any) -> Passage:  # noqa: ANN401
    """Return the candidate with the most evidence; for the settings see `try_candidates`."""
    tried = try_candidates(beats, **settings)
    best = tried.best
    beyond_mm = tried.beyond_mm()
    channels = np.concatenate([tried.weighted[np.newaxis], beats.channels])
    means = averages(
        channels,
        beyond_mm[np.newaxis] / tried.unit_mm,
        tried.behind_mm / tried.unit_mm,
        tried.dwell,
    )
    evidence, level, depth, shape = means[:, 0].tolist()
    return Passage(
        evidence,
        level,
        depth,
        shape,
        float(tried.place_mm[best]),
        float(beats.centre[np.abs(beyond_mm).argmin()]),
        float(tried.lag_samples[tried.speed[best]]),
        *beats.channels.std(axis=2).mean(axis=1).tolist(),
    )
