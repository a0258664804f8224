"""Collect what the page shows of one recording, and what neither its fit nor another one changes.

Signals are packed (`capsule.page.packing`). The page draws particles from their parameters.
"""

import numpy as np

from capsule.arrays import FloatArray
from capsule.detectors.network import FIRST_STRETCH, STRETCH_STEP
from capsule.detectors.search import CHANNELS, WINDOWS_A_WAVE, beats_of, search_beats
from capsule.detectors.wave import Wave
from capsule.kinds import Cells, Row, Settings
from capsule.method.preprocessing import preprocess_run
from capsule.page.packing import deflated, pack, to_json
from capsule.page.quality_map import quality_words, sensor_measures
from capsule.recordings.units import reading_unit

# Envelopes and matrices are smooth over the window of the envelope, so more points add no detail.
SMOOTH_POINTS = 250


def plot_data(
    name: str,
    values: FloatArray,
    wave: Wave | None,
    check: Row,
    stretches: tuple[float, FloatArray] | None,
    settings: Settings,
) -> Cells:
    """Return what the page shows of one recording alone; what is drawn is deflated JSON.

    The (S, K) values lie on an even grid in time, and `stretches` are from
    `capsule.detectors.network.score_stretches`. What is not known is None.
    """
    rate_hz, diagonal = settings["recording"]["rate_hz"], settings["diagonal"]
    window, threshold = (settings["preprocessing"][key] for key in ("window", "threshold"))
    run = preprocess_run(name, "", values, rate_hz=rate_hz, window=window, threshold=threshold)
    every = max(1, -(-run.time_s.size // SMOOTH_POINTS))
    beats, gut = along_gut(wave, rate_hz, diagonal) or (None, None)
    facts = {"File": f"raw/{name}.csv", "SHA-256": check["sha256"]}
    drawn = {
        "interval_s": float(run.time_s[1] - run.time_s[0]),
        "threshold": threshold,
        "readings": pack(run.values),
        "envelope": {"every": every, **pack(run.envelope[:, ::every], 8)},
        "unit": reading_unit(check["header"], run.values),
        "beats": beats,
        "gut": gut,
        "stretches": _stretches(*stretches, beats, diagonal) if beats and stretches else None,
        "peaks": peaks(run.envelope, run.time_s, threshold),
        "facts": facts | {f"# {key}": text for key, text in check["header"].items()},
    }
    quality = quality_words(values, check["at_ends"], rate_hz)
    measures = sensor_measures(wave, check["at_ends"])
    return {"quality": quality, "measures": measures, "drawn": deflated(to_json(drawn))}


def peaks(envelope: FloatArray, time_s: FloatArray, threshold: float) -> list[list[float]]:
    """Return each sensor's highest envelope value in SD, its time in s, and the time above it in s.

    Above it means above the threshold c.
    """
    above_s = (envelope > threshold).sum(axis=1) * float(time_s[1] - time_s[0])
    rows = zip(
        np.nanmax(envelope, axis=1), time_s[np.nanargmax(envelope, axis=1)], above_s, strict=True
    )
    return [[round(float(number), 3) for number in row] for row in rows]


def along_gut(wave: Wave | None, rate_hz: float, settings: Settings) -> tuple[Cells, Cells] | None:
    """Return the beats, and the evidence from which the diagonal detector chooses the best place.

    Beats are in units of a sensor's usual depth. A sensor that stays farther from the place with
    the most evidence than the extent of a place passes it at no time. The evidence is the largest
    over all mean speeds; its maximum is the detector's score. None if there is no wave.
    """
    beats = beats_of(wave, settings)
    if beats is None:
        return None
    _, evidence, beyond_mm = search_beats(beats, settings)
    depth = 1.0 + beats.channels[CHANNELS.index("depth")]
    behind_mm = settings["pitch_mm"] * np.arange(len(depth))
    off_mm = np.abs(beyond_mm - behind_mm[:, np.newaxis])
    nearest = zip(off_mm.min(axis=1), beats.centre[off_mm.argmin(axis=1)], strict=True)
    drawn = {
        "first_s": float(beats.centre[0]) / rate_hz,
        "step_s": beats.step / rate_hz,
        "passed_s": [
            round(float(at) / rate_hz, 2) if off <= settings["width_mm"] else None
            for off, at in nearest
        ],
        **pack(depth, 8),
    }
    return drawn, {"step_mm": settings["step_mm"], **pack(evidence[np.newaxis], 8)}


def _stretches(score: float, loss: FloatArray, beats: Row, settings: Settings) -> Cells:
    beat_s = settings["wavelength_mm"] / settings["wave_speed_mm_s"] / WINDOWS_A_WAVE
    return {
        "score": round(score, 4),
        "first_s": round(beats["first_s"] + FIRST_STRETCH * beat_s, 4),
        "step_s": round(STRETCH_STEP * beat_s, 4),
        **pack(loss[np.newaxis], 8),
    }
