"""Make a survey by formula: it suspects two places, goes back to the first and confirms it."""

import csv
import io
import json

import numpy as np

RATE_HZ = 10
EVERY = 8
WAVE_MM_S, WAVELENGTH_MM, PITCH_MM = 25.0, 80.0, 6.3
# Place of a crest of the wave at the start, in mm.
CREST_MM = 17.0
# The keys of the section `diagonal` that such a survey needs.
DETECTOR = {
    "wavelength_mm": WAVELENGTH_MM,
    "wave_speed_mm_s": WAVE_MM_S,
    "pitch_mm": PITCH_MM,
    "full_scale": 1024,
    "pressing_lowers_reading": True,
}
# The states of the fold board, and the times in s that lie between them.
FOLDS = np.array(["unfolded", "folding", "folded", "unfolding", "unfolded"])
MOVES_S = [120, 125.6, 200, 205.6]
# Time in s, state before, event, state after, position in mm, score.
EVENTS = [
    (8.0, "starting", "placed", "exploring", 4.0, None),
    (96.0, "exploring", "suspected", "finishing", 48.0, 0.31),
    (120.0, "finishing", "passed", "folding", 60.0, 0.42),
    (125.6, "folding", "folded", "returning", 60.0, None),
    (200.0, "returning", "far_enough", "unfolding", 60.0, None),
    (205.6, "unfolding", "unfolded", "finding", None, None),
    (216.0, "finding", "placed", "passing", 28.0, None),
    (280.0, "passing", "confirmed", "exploring", 60.0, 0.4),
    (320.0, "exploring", "suspected", "finishing", 80.0, 0.2),
    (340.0, "finishing", "stopped", "closing", 90.0, None),
    (344.0, "closing", "unfolded", "ended", None, None),
]
PLACES = [
    [1, "confirmed", 36.4, 2, 3.1, 2.4, 3.9, 0.42, 6.0, 0.15, "recordings/place-01-pass-1.csv"],
    [2, "undecided", 71.0, 1, "", "", "", 0.2, "", 0.15, ""],
]
PLACE_HEAD = ["place", "status", "place_mm", "passes", "size_mm", "size_low_mm", "size_high_mm"]
PLACE_HEAD += ["evidence", "height", "threshold", "recordings"]


def head_mm(time_s):
    """Return the position of the head, which moves at 0.5 mm/s, except on the way back."""
    return np.interp(time_s, [0, *MOVES_S, 344], [0, 60, 60, 22, 22, 91.2])


def stream_rows():
    """Return the head and the rows of stream.csv."""
    time_s = np.round(np.arange(0, 344.05, 1 / RATE_HZ), 3)
    wave_mm, head = WAVE_MM_S * time_s, head_mm(time_s)
    fold = FOLDS[np.searchsorted(MOVES_S, time_s)]
    rows = []
    for number, now_s in enumerate(time_s):
        behind_mm = head[number] - PITCH_MM * np.arange(4)
        angle = 2 * np.pi * (behind_mm - wave_mm[number] - CREST_MM) / WAVELENGTH_MM
        counts = np.rint(512 - 60 * np.cos(angle)).astype(int).tolist()
        judged = ["", "", ""]
        if number % EVERY == 0 and number:
            # The survey knows its position again two waves after the origami has unfolded.
            known = fold[number] == "unfolded" and not 205.6 < now_s < 212
            score = 0.05 + 0.35 * np.exp(-(((head[number] - 55.2) / 3) ** 2))
            told = [f"{head[number]:.2f}", f"{score:.5f}"] if known else ["", ""]
            judged = [*told, "0.15000"]
        rows.append([f"{now_s:.3f}", *counts, f"{wave_mm[number]:.2f}", *judged, fold[number]])
    sensors = [f"sensor_{sensor}" for sensor in range(1, 5)]
    return ["time_s", *sensors, "wave_mm", "head_mm", "score", "threshold", "fold"], rows


def table(head, rows):
    """Return a table as the bytes of a CSV file."""
    stream = io.StringIO()
    csv.writer(stream, lineterminator="\n").writerows([head, *rows])
    return stream.getvalue().encode()


def session_contents(**about):
    """Return the contents of a session's files by their names."""
    names = ("time_s", "before", "event", "after", "position_mm", "score")
    lines = [
        dict(zip(names, event, strict=True))
        | {"reason": f"since {event[2]}", "threshold": 0.15 if event[5] else None}
        for event in EVENTS
    ]
    return {
        "stream.csv": table(*stream_rows()),
        "events.jsonl": "".join(f"{json.dumps(line)}\n" for line in lines).encode(),
        "places.csv": table(PLACE_HEAD, PLACES),
        "session.json": json.dumps({"source": "simulated survey", "metres": 0.1, **about}).encode(),
    }


def write_session(folder, contents=None):
    """Write a session's files into a new folder."""
    folder.mkdir(parents=True)
    for name, content in (contents or session_contents()).items():
        (folder / name).write_bytes(content)
