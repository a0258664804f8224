"""Choose the columns of a table that hold the time and the sensors, and find the readings' unit."""

import re
from collections import Counter, defaultdict
from collections.abc import Collection, Sequence

import numpy as np

from capsule.errors import CapsuleError
from capsule.importing.lab_yaml import Keys
from capsule.importing.stated import (
    NOTE,
    bare_unit,
    described_unit,
    mentioned_unit,
    named_columns,
    notes_of,
    scaling_remarks,
    speaks_of_scaling,
)
from capsule.importing.table import QuestionError, Table, naming
from capsule.importing.text import STAMP_NAME
from capsule.importing.times import NO_TIME, WRAPS, text_kind, unwrapped
from capsule.importing.units import (
    LEAST_COUNT,
    NUMBER,
    THOUSANDFOLD,
    WRITTEN,
    is_time_name,
    is_unit,
    split_unit,
    unit_of,
)
from capsule.recordings.names import displayed
from capsule.recordings.scaling import scales

_COUNTER_NAMES = re.compile(
    r"(samples?|index|frames?|n|no|nr|number|count(er)?|#|row|line|id|seq|unnamed.*)"
    r"( ?(number|no|nr|index|#))?\.?",
    re.IGNORECASE,
)
_NUMBERED = re.compile(r"(.*?)[\[(]?([0-9]+)[\])]?")
# What follows the number of a sensor and is short, or a share, or a multiple: no name, but a unit.
_BEHIND_NUMBER = re.compile(
    r"\D*[0-9]+[\s_/,:;-]*"
    r"(%.*|[Pp]ercent|[cdnµμu]N|oz|[mµμun]S|[*x\u00d7] ?[0-9.]+|"
    r"(?:in )?(?:[0-9]*[.]|1/)[0-9]+ ?[^\W\d]\S*|.+[\s_*][x\u00d7] ?[0-9.]+)"
)
# The letter of a unit behind the number of a sensor, as in S1_T.
_LETTER = re.compile(r"\D*[0-9]+[\s_./,:;-]+([NgGTACFWJKS])")
# The name of a column with what turns numbers into readings, and most different numbers in it.
_SCALING_COLUMN = re.compile("gain|scal|factor|slope|sensitiv|lsb", re.IGNORECASE)
_MOST_SCALINGS = 8
# A full scale up to this is in volts, a larger one in counts.
_HIGHEST_VOLTS = 60.0
# Least reading, and range of the largest one, that fit a unit.
_FITS = {
    "counts": (0, 0, np.inf),
    "V": (0, 0, 5.5),
    "mV": (0, 100, 5500),
    "ohm": (100, 100, 1e7),
    "kohm": (0.1, 0.1, 1e4),
}
_HIGHEST_COUNT = 65_535.0


def choose_columns(
    table: Table, keys: Keys, questions: list[str]
) -> tuple[int | None, tuple[int, ...], int | None]:
    """Return the columns of time, sensors and run, by lab.yaml, then by names, then by position.

    Where more than one choice fits, a question is added to `questions`.

    Returns
    -------
    time : int or None
        Index of the column of the time; None if there is none, or several can be it.
    sensors : tuple of S int
        Indices of the sensors' columns; all that can be one, if it is asked.
    run : int or None
        Index of the column that names the run; None if there is none.

    Raises
    ------
    CapsuleError
        If a named column does not exist.
    """
    run = None if keys.run_column is None else _named_column(table, keys.run_column, "run_column")
    given = keys.sensors or ()
    picked = tuple(_named_column(table, each, "sensors") for each in given)
    for wanted, index in zip(given, picked, strict=True):
        name = table.names[index]
        if str(wanted).isdecimal() and name != str(wanted) and is_time_name(name):
            raise CapsuleError(
                f"sensors: column {wanted} is {name!r}, which holds the time; name the sensors' "
                "columns, or give their numbers, from 1 on"
            )
    if keys.time is None:
        times = _times(table, {*picked, run}, 0 if picked else keys.sensor_count)
        if len(times) > 1:
            listed = table.listed(times)
            questions.append(f"the columns {listed} can all be the time; name one with --time")
        time = times[0] if len(times) == 1 else None
    else:
        time = None if keys.time == NO_TIME else _named_column(table, keys.time, "time")
        times = [] if time is None else [time]
    for twice, count in Counter((time, *picked)).items():
        if twice is not None and count > 1:
            raise CapsuleError(
                f"column {table.listed([twice])} is named twice; name another column with --time "
                "or --sensors"
            )
    if not picked:
        picked = _sensors(table, {*times, run}, keys.sensor_count)
        if len(picked) != keys.sensor_count:
            count = keys.sensor_count
            questions.append(
                f"{len(picked)} columns can be sensors, {table.listed(picked) or 'none'}, and "
                f"there are {count} sensors; name {count} with --sensors, in the order of the "
                "sensors, or set recording.sensors of the configuration"
            )
    return time, picked, run


def _named_column(table: Table, wanted: str | int, key: str) -> int:
    """Return the index of a column, by its name (with or without its unit) or number from 1."""
    plain = wanted.strip().lower() if isinstance(wanted, str) else None
    names, count = [name.strip().lower() for name in table.names], len(table.names)
    bare = [split_unit(name)[0].strip() for name in names]
    matching = [at for at in range(count) if names[at] == plain]
    matching = matching or [at for at in range(count) if bare[at] == plain]
    if len(matching) == 1:
        return matching[0]
    if not matching and str(wanted).isdecimal() and 1 <= int(wanted) <= count:
        return int(wanted) - 1
    what = "is the name of several columns; give its number" if matching else "is not a column"
    listed = table.listed(list(range(count)))
    raise CapsuleError(f"{key}: {wanted!r} {what}; columns 1 to {count} are {listed}")


def _times(table: Table, taken: Collection[int | None], sensors: int) -> list[int]:
    """Return the columns that can be the time; `sensors` other columns of numbers must remain."""
    free = [at for at in range(len(table.names)) if at not in taken]
    numbers = [at for at in free if table.channels[at].holds_numbers]
    texts = [at for at in free if text_kind(table.channels[at])]
    named = [at for at in free if at in numbers + texts and is_time_name(table.names[at])]
    # If no column is left over, a rising column is a sensor.
    rising = (
        [at for at in numbers if _rises(table.channels[at].values)]
        if len(numbers) > sensors
        else []
    )
    clocks = [at for at in rising if not _is_counter(table, at)] or rising
    if len(clocks) > 1 and clocks[0] == 0 and not table.names[0]:
        # Without names, the first column is the time, unless another one also steps evenly.
        clocks = [at for at in clocks if _steps_evenly(table.channels[at].values)]
    stamps = [at for at in texts if table.names[at] == STAMP_NAME]
    return named or clocks or stamps or texts


def _rises(values: np.ndarray) -> bool:
    if values.size < 2 or not np.isfinite(values).all():
        return False
    return bool(np.all(np.diff(unwrapped(values, WRAPS)[0]) > 0))


def _steps_evenly(values: np.ndarray) -> bool:
    """Return whether most steps are near the median, as those of a clock are."""
    steps = np.diff(values)
    median = float(np.median(steps))
    return bool(np.mean(np.abs(steps - median) <= 0.5 * abs(median)) > 0.5)


def _sensors(table: Table, taken: Collection[int | None], sensors: int) -> tuple[int, ...]:
    """Return the columns of the sensors: those with numbered names, or all that can be one."""
    free = [
        at for at in range(len(table.names)) if at not in taken and table.channels[at].holds_numbers
    ]
    families = defaultdict(list)
    for index in free:
        if match := _NUMBERED.fullmatch(split_unit(table.names[index])[0].strip()):
            families[match[1].lower()].append((int(match[2]), index))
    whole = [sorted(members) for members in families.values() if len(members) == sensors]
    if len(whole) == 1:
        return tuple(index for _, index in whole[0])
    plain = [
        at for at in free if not (_is_counter(table, at) and _rises(table.channels[at].values))
    ]
    # Beside --time none, there may be a column of the time.
    if len(plain) > sensors:
        plain = [at for at in plain if not is_time_name(table.names[at])]
    if len(plain) > sensors:
        plain = [at for at in plain if not _rises(table.channels[at].values)]
    return tuple(plain)


def _is_counter(table: Table, index: int) -> bool:
    return bool(_COUNTER_NAMES.fullmatch(table.names[index].strip()))


def reading_unit(table: Table, sensors: Sequence[int], keys: Keys) -> tuple[str, str]:
    """Return the unit of the sensors' readings, as lab.yaml names it, and the reason for it.

    `sensors` holds the indices of the columns. Of the keys, ``unit`` and ``full_scale`` are used.

    Raises
    ------
    CapsuleError
        If the file names a unit that cannot be used, or names none and several fit.
    """
    if keys.unit:
        return keys.unit, "given"
    _check_scaling(table, sensors)
    texts = [_named(table, index) for index in sensors]
    if not all(split_unit(table.names[index])[1] for index in sensors):
        _check_each_has_unit(table, sensors)
    texts = _named_units(table, sensors, texts)
    units = [unit_of(text) or "" for text in texts]
    if mentions := [] if any(texts) and "" in units else _mentions(table, sensors, texts, units):
        named = f"names {displayed(texts[0])[:60]} and " if any(texts) else ""
        raise QuestionError(
            f"the file {named}says {displayed(mentions[0])[:60]!r}, and of no column that this is "
            "its unit; give the unit of the readings with --unit, or convert them first"
        )
    values = np.concatenate([table.channels[index].values for index in sensors])
    known = values[~np.isnan(values)]
    if not any(texts):
        for index in sensors:
            table.checked_numbers(table.channels[index])
        with naming(f"column {table.column_label(table.channels[sensors[0]])}"):
            return _by_values(known, keys.full_scale)
    if {*units} == {"counts"} and np.any(known % 1.0) and known.max() < LEAST_COUNT:
        raise QuestionError(
            f"the file names {texts[0]}, but readings from {known.min():g} to {known.max():g} are "
            "none; give --thousands point if points separate thousands, or else --unit"
        )
    if units[0] not in WRITTEN or len({*units}) > 1:
        alike = len({*texts}) == 1
        named = ", ".join(
            f"{displayed(text)[:60] or 'no unit'} of {table.column_label(table.channels[index])}"
            for index, text in zip(sensors[: 1 if alike else None], texts, strict=False)
        )
        raise QuestionError(
            f"the file names {named}{' and all others' if alike and len(texts) > 1 else ''}; "
            "allowed are counts, V, mV, ohm and kohm, the same for all sensors; use --unit if the "
            "readings have one of these units, or else convert them first"
        )
    return units[0], "named in the file"


def _check_scaling(table: Table, sensors: Sequence[int]) -> None:
    """Raise a question if the file states what turns its numbers into readings."""
    told = scaling_remarks(table.remarks)
    # A column of few numbers can hold it, too.
    for channel in (each for at, each in enumerate(table.channels) if at not in sensors):
        numbers = np.unique(channel.values[np.isfinite(channel.values)])
        if _SCALING_COLUMN.search(channel.name) and 0 < numbers.size <= _MOST_SCALINGS:
            text = f"{channel.name}: {', '.join(f'{number:g}' for number in numbers)}"
            if scales(channel.name, f"{numbers[-1]:g}"):
                told.append(text)
    if told:
        raise QuestionError(
            f"the file says {displayed(told[0])!r}, and not whether it is applied already; if it "
            "is, or is not needed, give the unit of the readings with --unit, or else convert them "
            "first"
        )


def _check_each_has_unit(table: Table, sensors: Sequence[int]) -> None:
    """Raise a question if remarks such as ``S1: mV`` name the unit of some of the sensors only."""
    names = {split_unit(table.names[index])[0].strip().lower() for index in sensors}
    names = {name for name in names if not (name[-1:].isdecimal() or is_unit(name))}
    told = defaultdict(list)
    for text in table.remarks:
        note = NOTE.fullmatch(text)
        described = described_unit(text) if note and bare_unit(note[3]) else ""
        unit = notes_of({0: text}).get("unit") or described
        # S2 alone is a column, and no square of a second.
        if unit and not named_columns(unit):
            numbers = {at for at in named_columns(text) if at <= len(table.names)}
            words = {*re.findall(r"\w+", text.lower())}
            told[unit_of(unit) or unit].append((text, numbers | (words & names)))
    for lines in told.values():
        columns = [named for _, named in lines]
        if all(columns) and len(set().union(*columns)) < len(sensors):
            raise QuestionError(
                f"the file says {displayed(lines[0][0])[:60]!r}, and not that each sensor has this "
                "unit; give the unit of all readings with --unit, or convert them first"
            )


def _named_units(table: Table, sensors: Sequence[int], texts: list[str]) -> list[str]:
    """Return the unit that the file names for each sensor, known or not; empty if it names none.

    `texts` holds what it names for the column alone.
    """
    # A letter behind the number of each sensor tells no two of them apart, so it is a unit.
    letters = [_LETTER.fullmatch(table.names[index]) for index in sensors]
    behind = [match[1] for match in letters if match]
    if len(behind) == len(sensors) > 1 and len({*behind}) == 1 and not any(texts):
        texts = behind
    # Different texts that are no units, such as (left) and (right), are names.
    if len({*texts}) == len(texts) > 1 and not any(map(is_unit, texts)):
        texts = [""] * len(texts)
    noted = table.notes.get("unit", "")
    for at, index in enumerate(sensors):
        is_adc = split_unit(table.names[index])[0].lower().startswith("adc")
        texts[at] = texts[at] or noted or ("counts" if is_adc else "")
    return texts


def _mentions(
    table: Table, sensors: Sequence[int], texts: Sequence[str], units: Sequence[str]
) -> list[str]:
    """Return what the file says of units in words, of no column, or against the named units."""
    names, noted = [table.names[index] for index in sensors], table.notes.get("unit", "")
    told = [
        name
        for name, unit in zip(names, units, strict=True)
        if (word := mentioned_unit(name, is_name=True)) and (not unit or unit_of(word) != unit)
    ]
    word = mentioned_unit(table.label, is_name=True)
    told += [table.label] if word and (unit_of(word) or word) not in units else []
    if not any(texts):
        told += [text for text in table.remarks if mentioned_unit(text) or described_unit(text)]
    # In a text or a workbook, nothing tells which of two units is nearer.
    elif table.lines is not None:
        told += [f"unit: {noted}"] if is_unit(noted) and unit_of(noted) not in units else []
        words = [
            (text, described_unit(text) if NOTE.fullmatch(text) else mentioned_unit(text))
            for text in table.remarks
        ]
        told += [text for text, word in words if word and unit_of(word) not in units]
    return told


def _named(table: Table, index: int) -> str:
    """Return the unit that the file names for a column, known or not; empty if it names none."""
    _, unit = split_unit(table.names[index])
    # Behind a name, as in S1_min, a unit of time is a word.
    bare = NUMBER.sub("", table.names[index])
    is_word = unit_of(unit) not in (None, *WRITTEN) and bare.endswith(unit)
    if is_unit(name := table.names[index]) and table.names.count(name) > 1:
        unit, is_word = name, False
    if match := _BEHIND_NUMBER.fullmatch(name):
        unit, is_word = match[1], False
    elif speaks_of_scaling(name.replace("_", " ")):
        return "a scaling"
    return table.channels[index].unit.strip() or ("" if is_word else unit)


def _by_values(known: np.ndarray, full_scale: float) -> tuple[str, str]:
    """Return the unit that fits all readings, of which none is missing, and the reason."""
    if known.size == 0:
        raise CapsuleError("it has no reading; name other columns with --sensors")
    low, high = float(known.min()), float(known.max())
    whole, below_scale = bool(np.all(known % 1.0 == 0)), LEAST_COUNT <= high < full_scale
    jumps = below_scale and not whole and high > THOUSANDFOLD * low
    span = f"readings from {low:.6g} to {high:.6g}"
    if low >= 0 and whole and below_scale:
        reason = f"whole numbers up to {high:g}, below diagonal.full_scale {full_scale:g}"
        return "counts", reason
    if low >= 0 and not whole and high <= full_scale <= _HIGHEST_VOLTS:
        return "V", f"{span}, within diagonal.full_scale {full_scale:g}"
    likely = {
        # Averaged counts are not whole, and kilo-ohms hardly ever are.
        "counts": high <= _HIGHEST_COUNT if whole else below_scale and not jumps,
        "kohm": not whole or high < LEAST_COUNT,
    }
    fitting = [
        unit
        for unit, (least, lowest, highest) in _FITS.items()
        if least <= low and lowest <= high <= highest and likely.get(unit, True)
    ]
    if len(fitting) == 1 and not jumps:
        return fitting[0], f"{span} fit no other unit"
    if not fitting:
        raise QuestionError(
            f"{span} fit no unit; if one of them marks a missing sample, name it with --missing, "
            "else give the unit with --unit"
        )
    options = " or ".join(f"{unit} (--unit {unit})" for unit in fitting)
    other = ", or --thousands point if points separate thousands" if jumps else ""
    raise QuestionError(f"{span} can be {options}; choose one{other}")
