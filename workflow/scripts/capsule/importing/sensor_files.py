"""Join files of one sensor each to one run."""

from collections.abc import Sequence
from types import SimpleNamespace

import numpy as np

from capsule.errors import CapsuleError
from capsule.importing.dates import later
from capsule.importing.mapped_runs import Bench, Guess, Run, header_of, make_run, readings
from capsule.importing.resampling import resample, usual_rate

# Time stamps that differ by less than this many intervals are the same time.
_SAME_INSTANT = 0.1


def joined_run(guesses: Sequence[Guess], keys: SimpleNamespace, bench: Bench) -> Run:
    """Return one run from the files of the sensors.

    Parameters
    ----------
    guesses : sequence of S Guess
        One table per sensor, in the order of the sensors.
    keys : SimpleNamespace
        The keys of lab.yaml.
    bench : Bench
        The configured values.

    Raises
    ------
    CapsuleError
        If the files have different units, or do not overlap in time.
    """
    units = {guess.unit.unit for guess in guesses}
    if len(units) > 1:
        raise CapsuleError(
            f"the sensors' files have different units, {' and '.join(sorted(units))}; "
            "give one with --unit"
        )
    times = [guess.clock.first_s + guess.clock.time_s for guess in guesses]
    rows = [readings(guess)[0][0] for guess in guesses]
    start = max(float(time_s[0]) for time_s in times)
    end = min(float(time_s[-1]) for time_s in times)
    if end <= start:
        raise CapsuleError(
            f"the sensors' files have no time in common: the last one begins at {start:g} s, the "
            f"first one ends at {end:g} s of their clocks; give files of one run"
        )
    started = later(guesses[0].clock.started, start - float(times[0][0]))
    header = header_of(guesses[0], keys, started)
    if _are_alike(times):
        values = np.array(rows)
        # If one sensor of a sample is missing, the whole sample counts as missing.
        values[:, np.isnan(values).any(axis=0)] = np.nan
        return make_run("", times[0] - start, values, header, bench)
    parts = []
    for time_s, row in zip(times, rows, strict=True):
        inside = time_s <= end + 0.5 / bench.rate_hz
        parts.append(resample(time_s[inside], row[None, inside], bench.rate_hz, start)[1][0])
    length = min(part.size for part in parts)
    values = np.array([part[:length] for part in parts])
    values[:, np.isnan(values).any(axis=0)] = np.nan
    rates = ", ".join(f"{usual_rate(time_s):.4g}" for time_s in times)
    header["import_resampled"] = f"from {rates} Hz to {bench.rate_hz:g} Hz and to the same instants"
    return make_run("", np.round(np.arange(length) / bench.rate_hz, 9), values, header, bench)


def _are_alike(times: Sequence[np.ndarray]) -> bool:
    first = times[0]
    if any(time_s.size != first.size for time_s in times):
        return False
    limit = _SAME_INSTANT / usual_rate(first)
    return all(bool(np.all(np.abs(time_s - first) <= limit)) for time_s in times)
