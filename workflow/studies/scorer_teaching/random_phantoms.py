"""Simulate recordings of phantoms with random parameters, as further data for the training."""

import numpy as np

from capsule.phantom.parameters import Phantom, value_of, with_values
from capsule.phantom.simulation import simulate_run

# A factor of 2 would move these parameters out of the model's range, so they vary less.
_GENTLE = (
    "contact.unit_stiffness_n_mm",
    "contact.patch_mm2",
    "contact.fold_limit_mm",
    "advance.speed_mm_s",
    "advance.lead_mm",
)
_FREE = (
    "wall.unevenness_mm",
    "wall.unevenness_length_mm",
    "contact.reach_mm",
    "contact.bearing_height_mm",
    "contact.series_offset_mm",
    "contact.height_offset_mm",
    "contact.coupling_spread",
    "contact.wander_mm",
    "contact.wander_time_s",
    "advance.speed_spread",
    "advance.stroke_spread",
    "advance.snag",
    "advance.hold_waves",
    "advance.lead_spread_mm",
    "sensor.gauge_per_mm",
    "sensor.saturation_mm",
    "sensor.lag_s",
    "sensor.creep_s",
    "sensor.settling",
    "sensor.settling_s",
    "sensor.drift_per_s",
    "sensor.noise",
)
# Standard deviations of the logarithm of a parameter's factor.
_GENTLE_SPREAD, _FREE_SPREAD = 0.2, 0.7


def draw_phantom(base: Phantom, numbers: np.random.Generator) -> Phantom:
    """Return a random phantom: many parameters are multiplied by a random factor."""
    spreads = dict.fromkeys(_GENTLE, _GENTLE_SPREAD) | dict.fromkeys(_FREE, _FREE_SPREAD)
    values = {
        name: value_of(base, name) * float(np.exp(numbers.normal(0, spread)))
        for name, spread in spreads.items()
    }
    return with_values(base, values)


def simulate_phantom(phantom: Phantom, sizes_mm: np.ndarray, seed: int) -> list[np.ndarray]:
    """Return simulated recordings of a phantom, in counts.

    Parameters
    ----------
    phantom : Phantom
        The bench.
    sizes_mm : (n,) array
        Size of the nodule in each recording, in mm; 0 for none.
    seed : int
        Seed of the archive.

    Returns
    -------
    list of n (4, K) arrays
    """
    return [
        simulate_run(phantom, float(size), seed, f"{size:g}mm/r{number:02d}").counts
        for number, size in enumerate(sizes_mm.tolist())
    ]
