"""Make names that are valid as fields in MATLAB; they also name the files of other formats."""

import re
from collections.abc import Iterable

# The value of namelengthmax in MATLAB.
_LONGEST_NAME = 63
_KEYWORD = re.compile(
    "break|case|catch|classdef|continue|else|elseif|end|for|function|global|if|otherwise|parfor|"
    "persistent|return|spmd|switch|try|while"
)


def legal_names(names: Iterable[str]) -> dict[str, str]:
    """Return unique field names, made as MATLAB's ``matlab.lang.makeValidName`` makes them.

    Parameters
    ----------
    names : iterable of str
        Names such as ``3mm/r07``.

    Returns
    -------
    dict of str to str
        The valid name of each, such as ``x3mm_r07``.
    """
    legal: dict[str, str] = {}
    taken = set()
    for name in names:
        keyword = _KEYWORD.fullmatch(name)
        joined = re.sub(r"\s+(\S?)", lambda match: match[1].upper(), name)
        base = re.sub(r"[^A-Za-z0-9_]", "_", name.capitalize() if keyword else joined)
        base = (base if base[:1].isalpha() and not keyword else f"x{base}")[:_LONGEST_NAME]
        legal[name], number = base, 0
        while legal[name] in taken:
            number += 1
            end = f"_{number}"
            legal[name] = base[: _LONGEST_NAME - len(end)] + end
        taken.add(legal[name])
    return legal
