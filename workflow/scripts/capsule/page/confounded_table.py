"""Warn that nodules or their sizes follow from the header, with the counts that show it."""

from collections import Counter
from collections.abc import Sequence

from capsule import words
from capsule.evaluation.confounded import KEYS, OWN, Confounded, in_words
from capsule.evaluation.value_alone import Told
from capsule.kinds import Cells

# With more values of a key, the rarer ones share a row.
MOST_VALUES = 6
# Characters of a value.
LONGEST = 80


def page_values(found: Sequence[Confounded]) -> Cells | None:
    """Return the page's warning, or None without a key from which a nodule or its size follows.

    Parameters
    ----------
    found : sequence of Confounded
        From `capsule.evaluation.confounded.confounded_keys`.

    Returns
    -------
    dict or None
        ``headline``, ``text`` and ``sizes``, the heads of the columns; ``keys``, each with its
        ``name`` and ``rows`` of a value and its counts.
    """
    if not found:
        return None
    # Of equal ones, the first.
    first = max(found, key=lambda each: (each.of_any, bool(each.nodules_mm)))
    of_nodules = first.of_any or first.nodules_mm
    learned = f"the {KEYS[first.key]} instead of the {'nodule' if of_nodules else 'size'}"
    can = "finds nodules" if of_nodules else "tells their sizes"
    told = f" {_told_words(first)}" if first.of_any else ""
    sizes_mm = sorted({size for each in found for of in each.counts.values() for size in of})
    return {
        "headline": f"A detector may have learned {learned}",
        "text": (
            f"Among the recordings that teach, {in_words(found)}.{told} So the rates below do not "
            f"show that a detector {can}. Record healthy places and nodules of every size with the "
            f"same {words.enumerate_words([KEYS[each.key] for each in found])}."
        ),
        "sizes": [words.size(size) for size in sizes_mm],
        "keys": [{"name": KEYS[each.key], "rows": _rows(each, sizes_mm)} for each in found],
    }


def _told_words(key: Confounded) -> str:
    told: Told = key.nodules
    return (
        f"Whoever knows nothing but the {KEYS[key.key]} finds "
        f"{words.count_of(round(told.found), round(told.of))} nodules, and calls "
        f"{words.count_of(round(told.passed), round(told.others))} healthy places healthy."
    )


def _rows(key: Confounded, sizes_mm: Sequence[float]) -> list[Cells]:
    """Return a row a value: the value in words, and its recordings of each size."""
    named = [(_words(key.key, value), of) for value, of in key.counts.items()]
    if len(named) > MOST_VALUES:
        rarer = named[MOST_VALUES - 1 :]
        together = sum((of for _, of in rarer), Counter())
        named[MOST_VALUES - 1 :] = [(f"{len(rarer)} rarer values", together)]
    return [{"value": value, "counts": [of[size] for size in sizes_mm]} for value, of in named]


def _words(key: str, value: str) -> str:
    if value in ("", OWN):
        return "another value at each place" if value else "not said"
    shown = value if len(value) <= LONGEST else f"{value[: LONGEST - 1]}…"
    return f"{shown} Hz" if key == "rate_hz" else shown
