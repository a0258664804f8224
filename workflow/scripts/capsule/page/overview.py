"""Count the recordings, name their origin, list what could not be used, and warn of confounding."""

from collections import Counter
from collections.abc import Sequence

import pandas as pd

from capsule import words
from capsule.evaluation.confounded import KEYS, OWN, Confounded, in_words
from capsule.kinds import Cells
from capsule.recordings.held_out import is_held_out, unknown_sessions
from capsule.recordings.origin import is_imported, origin_of

# With more values of a key, the rarer ones share a row.
MOST_VALUES = 6
# Sources that the page's title names.
MOST_NAMED = 2
# Characters of a value.
LONGEST = 80


def overview(index: pd.DataFrame, passed_over: pd.DataFrame, held_out: Sequence[str]) -> Cells:
    """Return the number of recordings, their origin, and what could not be used."""
    accepted = index[index["status"] == "accepted"]
    rejected = index[index["status"] != "accepted"]
    labelled = accepted[accepted["size_mm"].notna()]
    return {
        "not_held_out": unknown_sessions(index.to_dict("records"), held_out),
        "origin": origin_of(accepted["source"].fillna("").astype(str)),
        "labelled_origin": origin_of(labelled["source"].fillna("").astype(str)),
        "accepted": len(accepted),
        "by_size": labelled.groupby("size_mm").size().to_dict(),
        "held_out_sessions": [
            str(row["session"])
            for row in labelled.to_dict("records")
            if is_held_out(row["recording"], row.get("session"), held_out)
        ],
        "unlabelled": int(accepted["size_mm"].isna().sum()),
        "near_copies": _near_copies(accepted),
        "not_judged": accepted[["recording", "no_verdict"]].dropna().to_dict("records"),
        "rejected": rejected[["recording", "reason"]].fillna("").to_dict("records"),
        "passed_over": passed_over[["path", "reason"]].fillna("").to_dict("records"),
    }


def archive_name(index: pd.DataFrame) -> str:
    """Return what the page calls the archive: the sources of its recordings."""
    sources = origin_of(index["source"].fillna("").astype(str)).sources
    # Behind a comma stand a version, a seed and the like; of an import, the name of its file.
    kinds = list(
        dict.fromkeys(
            "imported recordings" if is_imported(name) else name.partition(",")[0]
            for name in sources
        )
    )
    named = ", ".join(kinds[:MOST_NAMED]) + (", …" if len(kinds) > MOST_NAMED else "")
    return named[:1].upper() + named[1:LONGEST] or "Origami capsule"


def _near_copies(accepted: pd.DataFrame) -> list[Cells]:
    """Return the groups of recordings that are nearly the same, each group once."""
    sizes_mm = dict(zip(accepted["recording"], accepted["size_mm"], strict=True))
    groups = {
        tuple(name for name in sizes_mm if name in {row.recording, *row.near_copies.split()})
        for row in accepted.dropna(subset="near_copies").itertuples()
    }
    return [
        {
            "recordings": list(names),
            "contradict": len({sizes_mm[name] for name in names if sizes_mm[name] >= 0}) > 1,
        }
        for names in sorted(groups, key=lambda names: list(sizes_mm).index(names[0]))
    ]


def confounded_values(found: Sequence[Confounded]) -> Cells | None:
    """Return the page's warning, or None without a key from which a nodule or its size follows."""
    if not found:
        return None
    # Of equal ones, the first.
    first = max(found, key=lambda each: each.nodules)
    sizes_mm = sorted({size for each in found for of in each.counts.values() for size in of})
    return {
        "first": first,
        "names": KEYS,
        "follows": in_words(found),
        "sizes": [words.size(size) for size in sizes_mm],
        "rows": [row for each in found for row in _rows(each, sizes_mm)],
    }


def _rows(key: Confounded, sizes_mm: Sequence[float]) -> list[Cells]:
    """Return a row a value: the key and the value in words, and its recordings of each size."""
    named = [(_words(key.key, value), of) for value, of in key.counts.items()]
    if len(named) > MOST_VALUES:
        rarer = named[MOST_VALUES - 1 :]
        together = sum((of for _, of in rarer), Counter())
        named[MOST_VALUES - 1 :] = [(f"{len(rarer)} rarer values", together)]
    return [
        {"name": KEYS[key.key], "value": value, "counts": [of[size] for size in sizes_mm]}
        for value, of in named
    ]


def _words(key: str, value: str) -> str:
    if value in ("", OWN):
        return "another value at each place" if value else "not said"
    shown = value if len(value) <= LONGEST else f"{value[: LONGEST - 1]}…"
    return f"{shown} Hz" if key == "rate_hz" else shown
