"""Make small recordings by formula, for tests that need data but no physics."""

from collections.abc import Iterable
from pathlib import Path

import numpy as np

from capsule.recordings.recording import Recording, format_recording
from capsule.seeding import generator


def make_recording(
    size_mm: float, name: str, samples: int = 700, sensors: int = 4, spacing: int = 130
) -> Recording:
    """Return a run with waves and noise on every sensor, and a bump at the nodule.

    The size determines the height of the bumps; 0 gives none. The name seeds the random numbers.
    The spacing is in samples between the bumps of neighbouring sensors.
    """
    numbers = generator(7, "synthetic", name)
    sample = np.arange(samples)
    # The wave, 80 mm long, reaches each sensor 6.3 mm after the one before.
    behind = 6.3 / 80.0 * np.arange(sensors)[:, np.newaxis]
    wave = 6.0 * np.sin(2.0 * np.pi * (sample / 32.0 - behind))
    values = np.round(512 + wave + numbers.normal(0.0, 4.0, (sensors, samples)))
    for s in range(sensors):
        centre = 120 + spacing * s + numbers.integers(-5, 6)
        values[s] += np.round(12.0 * size_mm * np.exp(-0.5 * ((sample - centre) / 25.0) ** 2))
    header = {"source": "formula of the tests", "rate_hz": "10", "adc_bits": "10"}
    return Recording(np.round(sample * 0.1, 3), values, header)


def write_archive(raw: Path, names: Iterable[str], **shape: int) -> None:
    """Write recordings such as ``3mm/r01`` below a folder; the size is read from the name."""
    for name in names:
        folder = name.split("/")[0]
        size_mm = 0.0 if folder == "unlabelled" else float(folder.removesuffix("mm"))
        path = raw / f"{name}.csv"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(format_recording(make_recording(size_mm, name, **shape)))
