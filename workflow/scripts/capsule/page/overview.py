"""Count the recordings, name their origin, and list what could not be used."""

from collections.abc import Sequence

import pandas as pd

from capsule import words
from capsule.held_out import is_held_out, unknown_sessions
from capsule.kinds import Cells
from capsule.page.provenance import Origin, origin_of


def overview(index: pd.DataFrame, passed_over: pd.DataFrame, held_out: Sequence[str]) -> Cells:
    """Return the number of recordings, their origin, and what could not be used.

    Parameters
    ----------
    index : DataFrame
        results/recordings.csv.
    passed_over : DataFrame
        results/passed_over.csv.
    held_out : sequence of str
        ``evaluation.held_out`` of the configuration.

    Returns
    -------
    dict
        ``not_held_out``, a sentence on held-out sessions that no recording carries. ``origin``,
        ``accepted``, ``by_size``, ``held_out_words``, ``unlabelled``, ``rejected`` and
        ``passed_over``.
        ``near_copies``, groups of recordings that are nearly the same, and whether their labels
        contradict. ``not_judged``, recordings that no detector judges, and why. Counts in words
        as ``accepted_words``, ``rejected_words`` and ``passed_over_words``.
    """
    accepted = index[index["status"] == "accepted"]
    rejected = index[index["status"] != "accepted"]
    labelled = accepted[accepted["size_mm"].notna()]
    by_size = labelled.groupby("size_mm").size()
    origin = origin_of(accepted["source"].fillna("").astype(str))
    return {
        "not_held_out": _not_held_out(index, held_out),
        "origin": {"kind": origin.kind, **_origin_words(origin)},
        "accepted": len(accepted),
        "accepted_words": words.plural(len(accepted), "recording"),
        "by_size": [
            {"size": words.size(float(size)), "count": int(count)}
            for size, count in by_size.items()
        ],
        "held_out_words": _held_out_words(labelled, held_out),
        "unlabelled": int(accepted["size_mm"].isna().sum()),
        "near_copies": _near_copies(accepted),
        "not_judged": accepted[["recording", "no_verdict"]].dropna().to_dict("records"),
        "rejected": rejected[["recording", "reason"]].fillna("").to_dict("records"),
        "rejected_words": words.plural(len(rejected), "recording"),
        "passed_over_words": words.plural(len(passed_over), "other file"),
        "passed_over": passed_over[["path", "reason"]].fillna("").to_dict("records"),
    }


def labelled_origin(index: pd.DataFrame) -> str:
    """Return the kind of origin of the accepted recordings of known size."""
    labelled = index[(index["status"] == "accepted") & index["size_mm"].notna()]
    return origin_of(labelled["source"].fillna("").astype(str)).kind


def _not_held_out(index: pd.DataFrame, held_out: Sequence[str]) -> str:
    """Return a sentence on the configured sessions that no recording carries; empty for none."""
    missing = unknown_sessions(index.to_dict("records"), held_out)
    if not missing:
        return ""
    which = "this session" if len(missing) == 1 else "these sessions"
    return (
        f"evaluation.held_out names {words.enumerate_words(missing)}, but no recording of known "
        f"size carries {which}."
    )


def _held_out_words(labelled: pd.DataFrame, held_out: Sequence[str]) -> str:
    """Return a sentence on the recordings that are held out; empty for none."""
    kept = [
        row["session"]
        for row in labelled.to_dict("records")
        if is_held_out(row["recording"], row.get("session"), held_out)
    ]
    if not kept:
        return ""
    sessions = list(dict.fromkeys(map(str, kept)))
    named = f"session{'' if len(sessions) == 1 else 's'} {words.enumerate_words(sessions)}"
    verb = "is" if len(kept) == 1 else "are"
    return f"{len(kept)} of these {verb} held out ({named}): they judge, and teach nothing."


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


def _origin_words(origin: Origin) -> Cells:
    """Return a headline and a text on the recordings' origin."""
    total = origin.simulated + origin.recorded + origin.silent
    match origin.kind:
        case "simulated":
            headline = "Simulated recordings"
            text = (
                f"A simulator made all {words.plural(total, 'recording')}. The numbers show how "
                "the method behaves on simulated signals. They say nothing about how well a real "
                "capsule finds nodules."
            )
        case "recorded":
            headline = "Recorded data"
            text = (
                f"All {words.plural(total, 'recording')} name a source in their header, and no "
                "source is a simulator."
            )
        case "mixed":
            headline = "Mixed origin"
            parts = [
                f"{count} {what}"
                for count, what in (
                    (origin.simulated, "simulated"),
                    (origin.recorded, "from another source"),
                    (origin.silent, "without a source in the header"),
                )
                if count
            ]
            text = (
                f"Of the {words.plural(total, 'recording')}, {words.enumerate_words(parts)}. "
                "Rates over such a mixture hold for no bench. To judge the capsule, keep each "
                "source in an archive of its own."
            )
        case "unknown":
            headline = "Origin not stated"
            text = (
                "No recording names its source. Write a line such as “# source: bench 2” at the "
                "top of each file."
            )
        case _:
            headline = "No recordings"
            text = "There is no usable recording under raw/."
    sources = [f"{name} ({count})" for name, count in origin.sources.items()]
    return {"headline": headline, "text": text, "sources": sources}
