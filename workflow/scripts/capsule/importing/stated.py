"""Understand what a file states beside its samples: units, sampling rates and scalings.

A statement is a name with a value: an attribute, a property, a field of a structure or a line of a
text. Scopes hold the statements on a thing, and those on what is around it, nearest first.
"""

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from capsule.errors import CapsuleError
from capsule.importing.units import SECONDS, is_time_unit, is_unit, unit_of
from capsule.recordings.recording import DECISIVE
from capsule.recordings.scaling import is_scaling, scales

# Names of a unit.
UNIT = ("unit_string", "units", "unit", "unit_name", "engineering_units", "ni_unitdescription")
# Names of the time of the first sample: a number by the file's clock, or a date and time.
_START = re.compile(
    r"(?:(?:acquisition|recording|record|log|measurement|session)[ _]?)?(?:t[ _]?)?"
    r"(?:start(?:ed)?|began|begin|onset)(?:[ _]?(?:time|date|at|stamp|timestamp))*"
    r"(?:[ _(]+(?P<unit>[mnuµμ]?s)\)?)?|[tx]_?0(?:_s)?|wf_start_(?:offset|time)|first_timestamp",
    re.IGNORECASE,
)
# A remark with a number that can tell such a time, or another one.
_UNSURE_START = re.compile(
    r"(?!its name).*(start|begin|began|onset|delay|latency|trigger|epoch|date|recorded|created|"
    r"first sample|offset_m?s\b|\bt(ime)?[ _-]?offset|time ?stamp).*[0-9].*|"
    r".*[0-9]{1,2}:[0-9]{2}.*",
    re.IGNORECASE,
)
# A number of this name can be the frequency of a filter or of a wave, too.
UNSURE_RATE = re.compile("freq(uency)?", re.IGNORECASE)
# Names of a sampling rate, and of the time between two samples; with its unit or without.
_TIMING = re.compile(
    r"(?:(?P<rate>fs|s?rates?|odr|"
    r"(?:samp(?:le|ling)?|acquisition|scan|data|update)[_ ]?(?:rates?|freq(?:uency)?)|"
    rf"{UNSURE_RATE.pattern})|"
    r"(?P<step>(?:samp(?:le|ling)?|scan)[_ ]?(?:interval|period)|dt|delta[_ ]?[tx]|wf_increment))"
    r"(?:[_ ]*(?P<hz>k?hz)|(?:[_ ]|[_ ]*[\[(] *)(?P<unit>k?hz|k?sps|[mnuµμ]?s(?:ec)?|min)[\])]?)?",
    re.IGNORECASE,
)
_QUANTITY = re.compile(r"((?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:e[+-]?[0-9]+)?)[\s:]*(.*)", re.IGNORECASE)
_PER_SECOND = dict.fromkeys(["hz", "sps", "s/s", "/s", "1/s", "samples/s"], 1.0)
_PER_SECOND |= dict.fromkeys(["samples per second", "samples/sec", "s^-1"], 1.0)
_PER_SECOND |= dict.fromkeys(["khz", "ksps", "ks/s"], 1000.0)
# Without a unit, a longer time between two samples is hardly in seconds.
_LONGEST_INTERVAL_S = 5.0
# Units of readings that are no other words, wherever they stand, but not beside a number: a
# supply of 5 V, or "supply (V): 5", is no unit of the readings. In names, it is that of a sensor.
_MENTIONED = (
    r"(?:[kMhmGu\u00b5n]?Pa|[kh]pa|KPA|[mkh]?bar(?=\W*$)|mbar|[Mm][Mm] ?[Hh][Gg]|[cm]m[Hh]2[Oo]|"
    r"in[Hh]g|psi|PSI|[Tt]orr|"
    r"[mkcdnu\u00b5]N|N/(?:m|mm|cm)[\u00b22]?|k?gf|lbf|ozf|[Nn]ewtons?|(?:[Kk]ilo)?[Pp]ascals?|"
    r"[Gg]rams?(?:[ -]force)?|[mu\u00b5nkcd]V|(?:[Mm]illi|[Mm]icro|[Kk]ilo|[Cc]enti)?-?[Vv]olts?|"
    r"(?:[Kk]ilo|[Mm]ega|[Mm]illi)?-?[kKMm]?(?:[Oo]hms?|\u2126|\u03a9)|[mnu\u00b5p]A|[fpnu\u00b5]F|"
    r"microstrain|\u00b5\u03b5|[mu\u00b5n]T|(?:[Mm]icro|[Mm]illi)?-?[Tt]esla|[Gg]auss|\u00b0C|dB|"
    r"[Pp]ercent|(?:[Mm]icro)?siemens|"
    r"(?<=[\[(])(?:V|N|g|A|T|%)(?=[\]),])|(?<=[:=] )V(?=[;,)]|$)|"
    r"(?:(?<=\bin )|(?<=/ ))(?:N|g|A|T|%)(?=\W*$| of))"
)
_MENTION = re.compile(rf"(?<![\w.])(?<![0-9] ){_MENTIONED}(?![A-Za-z_0-9])(?![)\]] ?[:=] ?[0-9])")
_MENTION_IN_NAME = re.compile(
    rf"(?<![A-Za-z]){_MENTIONED}(?![A-Za-z])|(?<=[a-z]{{3}}[_ ])N(?=_?[0-9]+$)|"
    r"^(?:k?g|[mu]m|cm|k?Hz|bar|deg[CF]?|rad|oz|mG|[mu]S|ppm|%(?:FS)?|mm/s|l/min|[mu]?V(?:pp|rms)|"
    r"dBV|kcounts|ticks|norm(?:ali[sz]ed)?|log)[\s_.-]+[0-9]+$"
)
# A unit of time, as in "column 1: time [cs]"; one behind a number can be a duration.
_TIME_MENTION = re.compile(
    r"(?:^|[,;:{\"\d])\W{0,3}(?:times?|t|x|zeit|time ?stamps?|(?:first column|column 1)"
    r"(?= in ))(?:[ _]units?)?\W{1,6}(?:(?:is|are|in|as|units of) )*\W?"
    r"((?:1/[0-9]+ ?|(?<=units of )[0-9.]+ ?)?[A-Za-zµμ]+)(?=$|[\s,;\])}\"])",
    re.IGNORECASE,
)
_TIME_BASE = re.compile(r"(?:time ?base|tick) *[:=] *(.+)", re.IGNORECASE)
# Words for the step of a clock, other than one by 1.
_TIME_STEP = re.compile(
    r"(?!.*[:=\s]1(?:[.]0*)?(?: ?[mnuµμ]?s)?$)(?:.*\b(?:ticks?|jiffies)\b.*|"
    r".*\btime[ _-]?(?:base|scal(?:e|ing)|factor|resolution|step)s?\b.*[0-9].*|"
    r".*resolution of (?:the )?time.*[0-9].*|.*\b(?:tenths|hundredths|thousandths) of a s.*|"
    r"\w+\W+1/[0-9]+ ?s(?:ec\w*)?)",
    re.IGNORECASE,
)
# Words for a clock, its rate or its period, and the unit of either in a name.
_CLOCK = re.compile(
    r"(?:f_?cpu|\w*clk|clock|timer[0-9]?|counter|ticks?|takt|rtc|tsf|oscillator|crystal|quar[tz]z?|"
    r"time[ _-]?(?:base|stamps?))(?![a-z])(?P<name>.*)",
    re.IGNORECASE,
)
_NUMBER = r"(?<![\w.])([0-9][0-9,]*\.?[0-9]*(?:e[+-]?[0-9]+)?)"
_QUANTITIES = [
    re.compile(rf"{_NUMBER} ?(?:(kilo|mega|[kmg]?)(?:hz|hertz)|([mnuµμ]?s))\b", re.IGNORECASE),
    re.compile(rf"{_NUMBER}([kmg]?)\b()", re.IGNORECASE),
]
_CLOCK_UNIT = re.compile(r"(?<!per)[ _\[(]+(?:([kmg]?)hz|([mnuµμ]?s))[\])]?\s*[:=]", re.IGNORECASE)
_METRIC = {"": 1.0, "k": 1e3, "kilo": 1e3, "m": 1e6, "mega": 1e6, "g": 1e9}
# Names of what describes readings in words.
_DESCRIBES = re.compile(
    r"(channel[_ ])?(desc(ription)?|comments?|notes?|remarks?|columns|label|title|quantity|"
    r"measurand|info|"
    r"(long|standard|display|full)[_ ]?name)",
    re.IGNORECASE,
)
# A remark that speaks of a scaling, as "values x 10" or "1 LSB = 4.88 mV" does.
_PROSE = re.compile(
    r"(?=.*[0-9]).*\b(scal(ed?|ings?)|gain|(?<= )gain[0-9]+|offset|multipl\w+|factor|lsb|amplif\w+|"
    r"attenuat\w+|divi(de|sor)\w*|subtract\w*|resolution(?!.*bits?\b)|sensitivity|slope)\b.*|"
    r".*\b(tenths|hundredths|thousandths|normali[sz]ed)\b.*|"
    r".*\b(1|one) ?(count|digit|bit|step|unit)s? ?(=|is|are) ?[0-9.]+.*|"
    r".*[0-9] ?\w+ ?(per |/ ?)(count|digit|bit|lsb)s?\b.*|.*\b(multiplied|divided) by \w+.*|"
    r"[/\u00f7] ?[0-9.]+|"
    r"(.*[\s)(=])?([x\u00d7*] [0-9.]+|[x\u00d7*](10+|[0-9]*\.[0-9]+)|[0-9.]+ ?[x\u00d7]|"
    r"[0-9.]+ ?[*] ?\w+)([\s)].*)?",
    re.IGNORECASE,
)
# A remark that is a name and a number, and a symbol, as of a formula: what else it can mean is not
# known. Some letters number a run or a version, and others are a time.
_NAME_AND_NUMBER = re.compile(
    r"([A-Za-z]\w*)[\s:=,;]+([+-]?[0-9.]+(?:e[+-]?[0-9]+)?(?:\s*[^\s/]+/\S+|[,;].*)?)",
    re.IGNORECASE,
)
_SYMBOL = re.compile(r"(?![nijtv]|x_?0)[a-z]_?[0-9]?", re.IGNORECASE)
# Names of a mark of missing samples.
MARK = re.compile(
    r"_?fill.?value|(missing|nan|invalid).?values?|no.?data(.?values?)?", re.IGNORECASE
)
# Names of numbered columns, and words for all.
_OF_COLUMNS = re.compile(
    r"[A-Za-z]+_?[0-9]+|all|each|every|sensors?|channels?|to|in", re.IGNORECASE
)
# Columns of numbers that a remark names, as in "S1..S4" and "channel 1".
_COLUMNS = re.compile(
    r"(?<![\w.])(?:[A-Za-z]+_?|(?:sensor|channel|column)s? )([0-9]{1,3})"
    r"(?:\s*(?:\.\.+|-|to)\s*(?:[A-Za-z]+_?)?([0-9]{1,3}))?(?![A-Za-z0-9]|\.[0-9])",
    re.IGNORECASE,
)
# A remark of the form ``key: value``.
NOTE = re.compile(r"\s*([A-Za-zµ][\w /.µ-]{0,40}?)\s*([\[(][^\])]{1,20}[\])])?\s*[:=]\s*(.+)")
# What a comment, or a line above the samples, says of all readings.
_IN_UNIT = re.compile(
    r"(?:all )?(times?(?! ?base|[,;|\t](?! ?in\b))|"
    r"(?:\w+ ){0,3}(?:values?|readings?|data|signals?|sensors?|channels?|"
    r"pressures?|forces?|voltages?|resistances?))\b"
    r"(?:.* in (?:(?:unit|step|tick)s? of )?|[^,;|\t(\[:=]*[(\[:=] *)"
    r"([^\s,;()\[\]]+?|[0-9./e-]+ ?[a-zµμ]+)[)\]]?(?: (?:unit|step|tick)s?)?\.?",
    re.IGNORECASE,
)
_UNIT_LINE = re.compile(
    r"\W*((?:vertical |y[ _-]?)?units?|einheit)\s*[:=,;\s]\s*(\S+?)\W*", re.IGNORECASE
)
_TIME_AXIS = re.compile("time|zeit|x|horizontal", re.IGNORECASE)
# Lines with these keys may not contradict each other.
_DECISIVE = {*DECISIVE, "source", "started"}
# To look through more of a remark would take long.
_LONGEST_REMARK = 5000
# More values of an attribute are no list of units or scales.
_MOST_VALUES = 256


def attribute(scopes: Iterable[Mapping[str, Any]], name: str) -> str:
    """Return the nearest statement with a name, in lower case, as a text; empty for none."""
    values = (said[key] for said in scopes for key in said if key.lower() == name)
    return as_text(next(values, ""))


def stated_unit(
    scopes: Sequence[Mapping[str, Any]], around: Iterable[Mapping[str, Any]] = ()
) -> str:
    """Return the unit that the nearest of the scopes names; empty if none does.

    If it names several, or if a description around names another one, all of them are returned.
    """
    for said in scopes:
        named = [as_text(said[key]) for name in UNIT for key in said if key.lower() == name]
        if not any(named):
            continue
        others = [as_text(value) for key, value in said.items() if "unit" in key.lower()]
        others += [described_unit(text) for text in as_remarks(around)]
        is_time = is_time_unit(named[0].partition(" since ")[0])
        named += [text for text in others if is_unit(text) and not (is_time or is_time_unit(text))]
        return different(filter(None, named))
    # A description that is a unit, and nothing else, is that of the readings.
    bare = (
        bare_unit(as_text(value))
        for said in scopes
        for key, value in said.items()
        if key.lower() in ("description", "comment", "note", "quantity")
    )
    return next(filter(None, bare), "")


def different(units: Iterable[str]) -> str:
    """Return units as a text, with other words for the same one left out."""
    told: dict[str, str] = {}
    for text in units:
        told.setdefault(unit_of(text) or text.strip(), text)
    return " and ".join(told.values())


def as_text(value: Any) -> str:
    """Return a value as a text; of several values, each different one once."""
    return ", ".join(
        dict.fromkeys(decoded(each).strip() for each in np.ravel(value)[:_MOST_VALUES])
    )


def decoded(value: object) -> str:
    """Return a value as a text; the bytes of a text as UTF-8."""
    return value.decode("utf-8", "replace") if isinstance(value, bytes) else str(value)


def states_rate(name: str) -> bool:
    """Return whether a statement of this name tells a sampling rate, or its inverse."""
    return bool(_TIMING.fullmatch(name))


def stated_rates(scopes: Iterable[Mapping[str, Any]]) -> dict[str, float]:
    """Return the sampling rates in Hz in the nearest scope that states one surely, by their names.

    A value is a number, several numbers, or a text such as ``0.01 kHz``.
    """
    rates: dict[str, float] = {}
    for said in scopes:
        for name, value in said.items():
            if match := _TIMING.fullmatch(name):
                unit = match["hz"] or match["unit"] or ""
                told = match["rate"] or f"1 / {match['step']}"
                found = {*_rates_in(value, unit.lower(), is_step=bool(match["step"]))}
                for at, rate in enumerate(sorted(found)):
                    rates.setdefault(f"another {told}" if at else told, rate)
        if any(not UNSURE_RATE.fullmatch(name) for name in rates):
            break
    return rates


def _rates_in(value: Any, unit: str, *, is_step: bool) -> Iterator[float]:
    """Yield the sampling rates in Hz in a value, in the unit of its name; none if it is unclear."""
    text = as_text(value)
    # A comma between digits is a decimal sign, or between thousands; several part a list.
    is_list = text.count(",") > 1 or ", " in text
    parts = text.split(",") if is_list else [re.sub(r"(?<=\d),(?=\d{1,2}(?!\d))", ".", text)]
    for match in filter(None, (_QUANTITY.fullmatch(part.strip()) for part in parts)):
        number, word = float(match[1]), match[2].strip().lower() or unit
        if not word:
            word = "hz" if not is_step else "s" if number < _LONGEST_INTERVAL_S else "unknown"
        seconds = SECONDS.get(unit_of(word) or "", 0.0)
        if number and word in _PER_SECOND:
            yield round(number * _PER_SECOND[word], 9)
        elif number and seconds:
            yield round(1.0 / (number * seconds), 9)


def facts(scopes: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Return what is stated of a series, as attributes of `capsule.importing.table.Channel`.

    Its unit and the start by its clock are its own; its date and its rate may be those around it.
    """
    unit, _, date = stated_unit(scopes[:1], scopes).partition(" since ")
    told: dict[str, Any] = {"unit": unit, "started": date or attribute(scopes, "started")}
    told["rates_hz"] = stated_rates(scopes)
    for key, value in starts({name: as_text(each) for name, each in scopes[0].items()}).items():
        told[key] = told.get(key) or value
    return {key: value for key, value in told.items() if value or key == "start_s"}


def starts(said: Mapping[str, str]) -> dict[str, Any]:
    """Return the start that the statements on a series tell, as attributes of `Channel`."""
    told: dict[str, Any] = {}
    for name, value in said.items():
        match = _START.fullmatch(name)
        number = _QUANTITY.fullmatch(value.strip())
        unit = unit_of(number[2]) if number else None
        seconds = SECONDS.get(unit or (match and match["unit"]) or "s", 0.0)
        if match and number and unit is not None and seconds:
            told["start_s"] = float(number[1]) * seconds
        elif match:
            told["started"] = value
    return told


def unsure_start(remarks: Iterable[str]) -> str:
    """Return the remarks that may tell the start of a series; empty if none does."""
    return "; ".join(text for text in remarks if _UNSURE_START.fullmatch(text[:_LONGEST_REMARK]))


def mentioned_unit(text: str, *, is_name: bool = False) -> str:
    """Return the word for a unit of readings in words or a name; empty if there is none."""
    match = (_MENTION_IN_NAME if is_name else _MENTION).search(text[:_LONGEST_REMARK])
    return match[0] if match else ""


def described_unit(remark: str) -> str:
    """Return the unit that a remark such as ``comment: pressure in kPa`` names; empty for none."""
    note = NOTE.fullmatch(remark[:_LONGEST_REMARK])
    if not note or not _DESCRIBES.fullmatch(note[1]):
        return ""
    # A label can be a name, such as N or S2.
    is_name = note[1].lower().endswith(("label", "name", "title"))
    word = mentioned_unit(note[3]) or ("" if is_name else bare_unit(note[3]))
    return "" if is_time_unit(word) else word


def bare_unit(text: str) -> str:
    """Return the unit that a text is, with or without brackets; empty if it is none.

    If it holds a unit for each column, as ``s, N, N, N, N``, that of the readings is returned.
    Names of columns and words for all of them may stand before it, as in ``S1..S4 N``.
    """
    parts = re.split(r"[\s,;|]+|\.\.+|(?<=[0-9])[-:]", text[:_LONGEST_REMARK])
    words = list(filter(None, (word.strip(".:(){}[]-\"'") for word in parts)))
    before = [word for word in words[:-1] if not _OF_COLUMNS.fullmatch(word)]
    words = list(dict.fromkeys(before + words[-1:]))
    if len(words) > 1 and is_time_unit(words[0]):
        words = words[1:]
    # A can be the name of a run, but so can R or k, which are no other words for units, too.
    if len(words) != 1 or words[0] in ("r", "R", "k", "K") or unit_of(words[0]) == "sample":
        return ""
    return words[0] if is_unit(words[0]) else ""


def named_columns(remark: str) -> set[int]:
    """Return the numbers of the columns that a remark names; empty if it names none."""
    ranges = _COLUMNS.findall(remark[:_LONGEST_REMARK])
    return {at for begin, end in ranges for at in range(int(begin), int(end or begin) + 1)}


def said_of_clock(remark: str) -> tuple[str, float] | None:
    """Return what a remark says of the unit of a time, and this unit in s; None for nothing.

    It says the unit's word, or all of the remark. The unit is NaN if it is not understood.
    """
    text = remark[:_LONGEST_REMARK].strip()
    match = _TIME_BASE.fullmatch(text) or _TIME_MENTION.search(text)
    if match and is_unit(match[1]):
        return match[1], SECONDS.get(unit_of(match[1].removeprefix("1 ")) or "", np.nan)
    if _TIME_STEP.fullmatch(text):
        return text[:60], np.nan
    clock = _CLOCK.search(text)
    told = next(filter(None, (way.search(text) for way in _QUANTITIES)), None)
    if not (clock and told and (number := float(told[1].replace(",", "")))):
        return None
    prefix, unit = (told[2] or "").lower(), told[3]
    if named := _CLOCK_UNIT.search(clock["name"]):
        prefix, unit = (named[1] or "").lower(), named[2]
    if unit:
        return text[:60], number * SECONDS[unit_of(unit) or "s"]
    return text[:60], 1 / (number * _METRIC[prefix])


def as_remarks(scopes: Iterable[Mapping[str, Any]]) -> list[str]:
    """Return statements as words."""
    return [f"{name}: {as_text(value)}" for said in scopes for name, value in said.items()]


def speaks_of_scaling(text: str) -> bool:
    """Return whether a remark in words tells a scaling."""
    return bool(_PROSE.fullmatch(text[:_LONGEST_REMARK]))


def scaling_remarks(remarks: Iterable[str]) -> list[str]:
    """Return the remarks that tell a scaling of the readings, each once."""
    return [
        *dict.fromkeys(
            text[:60] for text in remarks if _tells_scaling(text) and not said_of_clock(text)
        )
    ]


def _tells_scaling(text: str) -> bool:
    note = NOTE.fullmatch(text)
    if note and is_scaling(note[1]):
        return scales(note[1], note[3])
    words = note[3] if note and _DESCRIBES.fullmatch(note[1]) else text
    if plain := _NAME_AND_NUMBER.fullmatch(words[:_LONGEST_REMARK]):
        is_symbol = _SYMBOL.fullmatch(plain[1]) and not re.fullmatch("[+]?[01]([.]0*)?", plain[2])
        if is_symbol or scales(plain[1], plain[2]):
            return True
    return speaks_of_scaling(text)


def notes_of(comments: Mapping[int, str]) -> dict[str, str]:
    """Return the comments of the form ``key: value``, by key; units under the keys ``unit``."""
    notes: dict[str, tuple[str, int]] = {}
    units: dict[str, list[str]] = {"unit": [], "time unit": []}
    for number, text in comments.items():
        if (match := _IN_UNIT.fullmatch(text)) and is_unit(match[2]):
            units["time unit" if match[1].lower().startswith("time") else "unit"].append(match[2])
        elif (match := _UNIT_LINE.fullmatch(text)) and is_unit(match[2]):
            units["unit"].append(match[2])
        elif word := bare_unit(text):
            units["time unit" if is_time_unit(word) else "unit"].append(word)
        elif match := NOTE.fullmatch(text):
            key, value = _key(match), match[3]
            if re.search("unit|einheit", key, re.IGNORECASE):
                key = "time unit" if _TIME_AXIS.match(key) else "unit"
                units[key].append(value)
            other, line = notes.get(key, (value, number))
            if (key in _DECISIVE or states_rate(key)) and other != value:
                raise CapsuleError(
                    f"lines {line} and {number} name two values of {key}, {other[:60]!r} and "
                    f"{value[:60]!r}; delete the line that is wrong"
                )
            notes[key] = value, number
    told = {key: value for key, (value, _) in notes.items()}
    return told | {key: different(each) for key, each in units.items() if each}


def states_much(text: str) -> bool:
    """Return whether a line of the form ``key: value`` states a rate or a scaling."""
    note = NOTE.fullmatch(text)
    return note is not None and (states_rate(_key(note)) or scales(note[1], note[3]))


def _key(note: re.Match[str]) -> str:
    """Return the key of a line ``key: value``, with what stands in brackets behind it."""
    return f"{note[1]} {note[2]}" if note[2] else note[1]


def states_unit(text: str) -> bool:
    """Return whether a line above the samples states a unit, as ``Vertical Units,kPa`` does."""
    return any(way.fullmatch(text) for way in (_UNIT_LINE, _IN_UNIT))
