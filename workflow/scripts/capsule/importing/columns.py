"""Choose the columns of a table that hold the time and the sensors."""

import re
from collections import defaultdict
from collections.abc import Sequence
from types import SimpleNamespace

import numpy as np

from capsule.errors import CapsuleError
from capsule.importing.table import QuestionError, Table
from capsule.importing.text import STAMP_NAME
from capsule.importing.times import text_kind
from capsule.importing.units import split_unit

_TIME_NAMES = re.compile(
    r"(time|t|timestamps?|time[ _]?stamps?|stamp|elapsed.*|zeit(stempel)?|temps|tiempo|tempo|"
    r"uhrzeit|millis.*|micros.*|date.?time|datum.*|date|clock|seconds|secs?|ms|us|x_value)",
    re.IGNORECASE,
)
_COUNTER_NAMES = re.compile(
    r"(samples?|index|frames?|n|no|nr|number|count(er)?|#|row|line|id|seq|unnamed.*)"
    r"( ?(number|no|nr|index|#))?\.?",
    re.IGNORECASE,
)
_NUMBERED = re.compile(r"(.*?)[\[(]?([0-9]+)[\])]?")
NO_TIME = "none"


def choose_columns(
    table: Table, keys: SimpleNamespace, sensors: int
) -> tuple[int | None, tuple[int, ...], int | None]:
    """Return the columns of time and sensors, by lab.yaml, then by names, then by position.

    Parameters
    ----------
    table : Table
        The table.
    keys : SimpleNamespace
        The keys of lab.yaml, of which ``time``, ``sensors`` and ``run_column`` are used.
    sensors : int
        Number of sensors S.

    Returns
    -------
    time : int or None
        Index of the column of the time; None if there is none.
    sensors : tuple of S int
        Indices of the sensors' columns.
    run : int or None
        Index of the column that names the run.

    Raises
    ------
    CapsuleError
        If a named column does not exist, or more than one choice fits.
    """
    run = None if keys.run_column is None else _named_column(table, keys.run_column, "run_column")
    given = keys.sensors
    picked = tuple(_named_column(table, each, "sensors") for each in given) if given else ()
    if len(set(picked)) < len(picked):
        raise CapsuleError(f"sensors: {given!r} names a column twice; name each sensor's own")
    for wanted, index in zip(given or (), picked, strict=True):
        name = table.names[index]
        if str(wanted).isdecimal() and name != str(wanted) and _is_time_name(name):
            raise CapsuleError(
                f"sensors: column {wanted} is {name!r}, which holds the time; name the sensors' "
                "columns, or give their numbers, from 1 on"
            )
    taken = {*picked, *([] if run is None else [run])}
    if keys.time == NO_TIME:
        time = None
    elif keys.time is not None:
        time = _named_column(table, keys.time, "time")
    else:
        time = _time(table, taken, 0 if picked else sensors)
    if time in picked:
        raise CapsuleError(
            f"column {table.column_label(picked[picked.index(time)])} is the time and a sensor; "
            "name another column with --time or --sensors"
        )
    if not picked:
        free = [
            index
            for index in range(len(table.names))
            if table.holds_numbers(index) and index not in {time, run}
        ]
        picked = _sensors(table, free, sensors)
    return time, picked, run


def _named_column(table: Table, wanted: str | int, key: str) -> int:
    """Return the index of a column, by its name (with or without its unit) or number from 1."""
    count = len(table.names)
    if isinstance(wanted, int) or (wanted.isdecimal() and not _by_name(table, wanted)):
        if 1 <= int(wanted) <= count:
            return int(wanted) - 1
        raise CapsuleError(f"{key}: {wanted} is not a column; there are columns 1 to {count}")
    matching = _by_name(table, wanted)
    if len(matching) == 1:
        return matching[0]
    what = "is the name of several columns; give its number" if matching else "is not a column"
    listed = table.listed(list(range(count)))
    raise CapsuleError(f"{key}: {wanted!r} {what}; the columns are {listed}")


def _by_name(table: Table, wanted: str) -> list[int]:
    names = [name.strip().lower() for name in table.names]
    plain = wanted.strip().lower()
    exact = [index for index, name in enumerate(names) if name == plain]
    return exact or [
        index for index, name in enumerate(names) if split_unit(name)[0].strip() == plain
    ]


def _time(table: Table, taken: set[int], sensors: int) -> int | None:
    """Return the column of the time; `sensors` other columns of numbers must remain."""
    free = [index for index in range(len(table.names)) if index not in taken]
    by_name = [index for index in free if _is_time_name(table.names[index])]
    by_name = [index for index in by_name if _may_be_time(table, index)]
    if len(by_name) == 1:
        return by_name[0]
    numbers = [index for index in free if table.holds_numbers(index)]
    # If no column is left over, a rising column is a sensor.
    rising = [
        index
        for index in (numbers if len(numbers) > sensors else [])
        if table.names[index] != STAMP_NAME and _rises(table.numbers[index])
    ]
    counters = [index for index in rising if _COUNTER_NAMES.fullmatch(table.names[index].strip())]
    candidates = by_name or [index for index in rising if index not in counters] or counters
    if len(candidates) > 1 and not by_name and candidates[0] == 0 and not table.names[0]:
        # Without names, the first column is the time, unless another one also steps evenly.
        candidates = [index for index in candidates if _steps_evenly(table.numbers[index])]
    if len(candidates) > 1:
        raise QuestionError(
            f"the columns {table.listed(candidates)} can all be the time; name one with --time"
        )
    if candidates:
        return candidates[0]
    texts = [index for index in free if _may_be_time(table, index, text=True)]
    if len(texts) == 1 or (texts and table.names[texts[0]] == STAMP_NAME):
        return texts[0]
    if texts:
        raise QuestionError(
            f"the columns {table.listed(texts)} can all be the time; name one with --time"
        )
    return None


def _is_time_name(name: str) -> bool:
    return bool(_TIME_NAMES.fullmatch(split_unit(name)[0]))


def _may_be_time(table: Table, index: int, *, text: bool = False) -> bool:
    """Return whether a column can be the time: dates, times of day or (unless `text`) numbers."""
    if table.texts is not None and text_kind(table.texts[index].tolist()):
        return True
    return table.holds_numbers(index) and not text


def _rises(values: np.ndarray) -> bool:
    return values.size > 1 and bool(np.isfinite(values).all() and np.all(np.diff(values) > 0))


def _steps_evenly(values: np.ndarray) -> bool:
    """Return whether most steps are near the median, as those of a clock are."""
    steps = np.diff(values)
    median = float(np.median(steps))
    return bool(np.mean(np.abs(steps - median) <= 0.5 * abs(median)) > 0.5)


def _sensors(table: Table, free: Sequence[int], sensors: int) -> tuple[int, ...]:
    """Return the columns of the sensors: those with numbered names, or all that are left."""
    families = defaultdict(list)
    for index in free:
        if match := _NUMBERED.fullmatch(split_unit(table.names[index])[0].strip()):
            families[match[1].lower()].append((int(match[2]), index))
    whole = [
        tuple(index for _, index in sorted(members))
        for members in families.values()
        if len(members) == sensors
    ]
    if len(whole) == 1:
        return whole[0]
    plain = [index for index in free if not _is_counter(table, index)]
    if len(plain) == sensors:
        return tuple(plain)
    if len(plain) < sensors:
        listed = table.listed(plain) if plain else "none"
        raise QuestionError(
            f"{len(plain)} columns of numbers are left for the sensors, but recording.sensors of "
            f"the configuration is {sensors}: {listed}; name them with --sensors"
        )
    raise QuestionError(
        f"the columns {table.listed(plain)} can all be sensors, and there are {sensors} sensors; "
        f"name {sensors} of them with --sensors, in the order of the sensors"
    )


def _is_counter(table: Table, index: int) -> bool:
    """Return whether a column counts samples."""
    is_named = bool(_COUNTER_NAMES.fullmatch(table.names[index].strip()))
    return is_named and _rises(table.numbers[index])
