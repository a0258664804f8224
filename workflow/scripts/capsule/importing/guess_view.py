"""Write how a file was read as text: its columns, the first samples, one trace per sensor."""

import numpy as np

from capsule.importing.runs import Guess
from capsule.importing.table import Table
from capsule.recording import Recording

_BARS = "▁▂▃▄▅▆▇█"
_PLAIN_BARS = "_.-=+*#@"
_WIDTH = 64
_FIRST_SAMPLES = 3


def guess_lines(guess: Guess) -> list[str]:
    """Return lines on how a table was read; each line begins with the key of lab.yaml.

    Parameters
    ----------
    guess : Guess
        How the table was read.
    """
    table, clock, reading = guess.table, guess.clock, guess.table.reading
    rows = [(key, reading.get(key, ""), "") for key in ("encoding", "delimiter", "decimal")]
    rows.append(("thousands", reading.get("thousands", "none").removeprefix("none"), ""))
    rows.append((table.kind, table.label, ""))
    rows.append(("time", "none" if guess.time is None else _named(table, guess.time), ""))
    if guess.time is not None:
        rows.append(("time_unit", clock.unit, clock.reason))
    else:
        rate, _, teller = clock.reason.partition(" by ")
        rows.append(("rate", rate, f"by {teller}"))
    for number, index in enumerate(guess.sensors, start=1):
        rows.append((f"sensor_{number}", _named(table, index), ""))
    rows.append(("unit", guess.unit, guess.unit_reason))
    used = {guess.time, guess.run, *guess.sensors}
    idle = [index for index in range(len(table.names)) if index not in used]
    rows.append(("not used", table.listed(idle), ""))
    passed_over = f"{len(table.passed_over)} lines without a whole sample"
    rows.append(("passed over", passed_over if table.passed_over else "", ""))
    rows = [row for row in rows if row[1]]
    left = max(len(name) for name, _, _ in rows)
    return [
        f"  {name:<{left}}  {value}" + (f"  ({reason})" if reason else "")
        for name, value, reason in rows
    ]


def _named(table: Table, index: int) -> str:
    name = table.names[index]
    return f"column {index + 1}" + (f", {name!r}" if name else "")


def sample_lines(recording: Recording, *, plain: bool) -> list[str]:
    """Return lines with the first samples of a recording, and one trace per sensor.

    Parameters
    ----------
    recording : Recording
        The recording as it is written to raw/.
    plain : bool
        Whether the terminal shows only ASCII.
    """
    names = ["time_s", *(f"sensor_{n}" for n in range(1, recording.values.shape[0] + 1))]
    samples = [
        [f"{time_s:g}", *("-" if np.isnan(value) else f"{value:.6g}" for value in sample)]
        for time_s, sample in zip(
            recording.time_s[:_FIRST_SAMPLES], recording.values.T[:_FIRST_SAMPLES], strict=True
        )
    ]
    lines = ["  " + "".join(f"{cell:>12}" for cell in row) for row in [names, *samples]]
    for name, values in zip(names[1:], recording.values, strict=True):
        known = values[~np.isnan(values)]
        span = f"{known.min():.6g} to {known.max():.6g}" if known.size else "no reading"
        lines.append(f"  {name}  {_trace(values, _PLAIN_BARS if plain else _BARS)}  {span}")
    return lines


def _trace(values: np.ndarray, bars: str) -> str:
    """Return readings (K,) as a line of bars, with blanks for missing samples."""
    each = -(-values.size // _WIDTH)
    parts = [values[at : at + each] for at in range(0, values.size, each)]
    parts = [part[~np.isnan(part)] for part in parts]
    means = [float(part.mean()) if part.size else None for part in parts]
    known = [mean for mean in means if mean is not None]
    low, span = min(known, default=0.0), max(known, default=0.0) - min(known, default=0.0)
    top = len(bars) - 1
    return "".join(
        " " if mean is None else bars[round((mean - low) / span * top) if span else 0]
        for mean in means
    )
