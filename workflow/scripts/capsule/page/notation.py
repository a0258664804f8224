"""Write equations and symbols as the paper prints them."""

import re
from collections.abc import Sequence

_LABEL = re.compile(r"\beq\. (\S+)")
_GREEK = {"Delta": "\u0394", "mu": "\u03bc", "sigma": "\u03c3"}
_SCRIPTS = {"": "base", "^": "sup", "_": "sub"}


def cited(where: str, equations: Sequence[str]) -> str:
    """Return a citation of the paper in which equations have their printed numbers.

    Parameters
    ----------
    where : str
        A section, or ``eq.`` and the label of an equation in the paper's source.
    equations : sequence of str
        The labels, in the order of the paper's numbers.

    Returns
    -------
    str
        For example ``Eq. 2``.

    Raises
    ------
    ValueError
        The paper has no equation of that label.
    """
    return _LABEL.sub(lambda match: f"Eq. {equations.index(match[1]) + 1}", where)


def typeset(symbol: str) -> list[dict[str, str]]:
    """Return the parts of a symbol such as ``Delta mu^hor``, for HTML.

    Parameters
    ----------
    symbol : str
        Letters and names of Greek letters; ``^`` raises and ``_`` lowers what follows.

    Returns
    -------
    list of dict
        ``text`` and ``kind``: ``upright`` for the sign of a difference, ``base`` for a variable,
        ``sup`` or ``sub``.
    """
    parts = []
    for script, name in re.findall(r"([\^_]?)([A-Za-z]+)", symbol):
        kind = "upright" if name == "Delta" else _SCRIPTS[script]
        parts.append({"kind": kind, "text": _GREEK.get(name, name)})
    return parts
