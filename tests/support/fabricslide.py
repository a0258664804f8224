"""Recordings of a tactile finger that slides over a board of ridges (wngfra/FabricSlide, MIT).

They lie in tests/data/fabricslide/ with their licence: 16 channels, a time stamp in ms.
"""

from pathlib import Path

import numpy as np

from capsule.recording import Recording

FOLDER = Path(__file__).parents[1] / "data" / "fabricslide"
# Along this row of taxels a ridge passes from one to the next.
CHANNELS = ["channel7", "channel8", "channel9", "channel10"]


def convert(file: Path) -> Recording:
    """Take the row of four channels as the capsule's four sensors."""
    with file.open(encoding="utf-8") as stream:
        names = [name.strip() for name in stream.readline().split(",")]
        table = np.loadtxt(stream, delimiter=",")
    time_ms = table[:, names.index("timestamp")]
    values = table[:, [names.index(channel) for channel in CHANNELS]].T
    header = {"source": f"FabricSlide, {file.stem}"}
    return Recording((time_ms - time_ms[0]) / 1000.0, values, header)
