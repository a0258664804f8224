"""Recognise statements of a scaling, which a file or a stream may have applied already.

No step of the workflow imports this module, so a new word changes no result.
"""

import re

# Names of what turns stored numbers into readings, which may be applied already.
_SCALING = re.compile(
    r"(?!wf_|(time|clock|utc|zone|trigger)[_ ]|offset[_ ][mnuµ]?s$|NI_(scal|number))"
    r"((\w+[_ ]|[xyv])?(scal|skal|gain|off$|offset|mult|factor|faktor|lsb|calib|amplif|"
    r"(probe.?)?attenu|verst.rk|probe|slope|tare|divi|sensitiv|empfindlich|cal$|bias|intercept|"
    r"baseline|polynom|coef|transform|quant(um|i[sz])|conversion|(physical|digital)_?(max|min)|"
    r"exponent|power$|(unit_?)?prefix|v?div$|increment$).*|"
    r"pga|amp|ratio|conv|zero([ _](level|point))?|nullpunkt|step[_ ]m?v|add_?offset|"
    r".*(per|/)[_ ]?(lsb|count|bit|digit|step|adu|div(ision)?|m?v(olt)?)s?[\])]?|"
    r"bit_?volts|(.*2|to_)volts)",
    re.IGNORECASE,
)
# What is no number of a scaling: none, a date, a duration, or a sensor's kind.
_NO_SCALING = re.compile(
    r"(none|no|off|false|yes|true|done|ok|n/?a|unscaled|raw|unknown)?|.*[0-9]{4}-[0-9]{2}-[0-9]{2}.*|"
    r"[0-9]{1,2}[./][0-9]{1,2}[./][0-9]{2,4}.*|[0-9.]+ ?(m?s|min|h|bits?)",
    re.IGNORECASE,
)


def is_scaling(name: str) -> bool:
    """Return whether a number of this name can turn stored numbers into readings."""
    return bool(_SCALING.fullmatch(name))


def scales(name: str, value: str) -> bool:
    """Return whether a statement tells a scaling of the readings, other than one by 1 and 0."""
    is_sum = re.search("offset|intercept|tare|bias|baseline", name, re.IGNORECASE)
    neutral = "[+-]?0*[.]?0*" if is_sum else "[+]?1([.]0*)? ?[xX]?"
    told = value.strip()
    return is_scaling(name) and not (re.fullmatch(neutral, told) or _NO_SCALING.fullmatch(told))
