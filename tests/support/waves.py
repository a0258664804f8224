"""Make readings of sensors under a wave, with deeper presses at one place."""

import numpy as np

from capsule.seeding import generator


def wave_readings(samples=800, deeper=0.0, sensors=4):
    """Return the readings; each sensor passes the place 150 samples after the one before it."""
    time = np.arange(samples)
    wave = np.sin(2 * np.pi * time / 32) + 0.2 * np.sin(4 * np.pi * time / 32)
    noise = generator(1, "readings").normal(0, 0.05, (sensors, samples))
    middle = 150 + 150 * np.arange(sensors)[:, np.newaxis]
    bump = deeper * np.exp(-(((time - middle) / 40) ** 2))
    return 500 - 20 * (1 + bump) * (wave + noise)
