"""Count the recordings, name their origin, and list what could not be used."""

import pandas as pd

from capsule import words
from capsule.kinds import Cells
from capsule.page.provenance import Origin, origin_of


def overview(index: pd.DataFrame, passed_over: pd.DataFrame) -> Cells:
    """Return the number of recordings, their origin, and what could not be used.

    Parameters
    ----------
    index : DataFrame
        results/recordings.csv.
    passed_over : DataFrame
        results/passed_over.csv.

    Returns
    -------
    dict
        ``origin``, ``accepted``, ``by_size``, ``unlabelled``, ``rejected`` and ``passed_over``.
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
        "origin": {"kind": origin.kind, **_origin_words(origin)},
        "accepted": len(accepted),
        "accepted_words": words.plural(len(accepted), "recording"),
        "by_size": [
            {"size": words.size(float(size)), "count": int(count)}
            for size, count in by_size.items()
        ],
        "unlabelled": int(accepted["size_mm"].isna().sum()),
        "near_copies": _near_copies(accepted),
        "not_judged": accepted[["recording", "no_verdict"]].dropna().to_dict("records"),
        "rejected": rejected[["recording", "reason"]].fillna("").to_dict("records"),
        "rejected_words": words.plural(len(rejected), "recording"),
        "passed_over_words": words.plural(len(passed_over), "other file"),
        "passed_over": passed_over[["path", "reason"]].fillna("").to_dict("records"),
    }


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
