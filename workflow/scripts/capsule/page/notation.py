"""Equations and symbols as a reader of the paper sees them."""

import re
from collections.abc import Sequence

_LABEL = re.compile(r"\beq\. (\S+)")
_GREEK = {"Delta": "\u0394", "mu": "\u03bc", "sigma": "\u03c3"}
_SCRIPTS = {"": "base", "^": "sup", "_": "sub"}


def cited(where: str, equations: Sequence[str]) -> str:
    """Return where something stands in the paper, its equations by their printed numbers.

    Parameters
    ----------
    where : str
        A section, or ``eq.`` and the label of an equation in the paper's source.
    equations : sequence of str
        The labels in the order in which the paper numbers them.

    Returns
    -------
    str
        Such as ``Eq. 2``.

    Raises
    ------
    ValueError
        The paper has no equation of that label.
    """
    return _LABEL.sub(lambda match: f"Eq. {equations.index(match[1]) + 1}", where)


def typeset(symbol: str) -> list[dict[str, str]]:
    """Return a symbol such as ``Delta mu^hor`` in parts that HTML can show.

    Parameters
    ----------
    symbol : str
        Letters and names of Greek ones; ``^`` raises and ``_`` lowers what follows.

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
