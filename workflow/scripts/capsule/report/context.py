"""What the page says: the values of the template, from the tables of a run."""

from collections.abc import Mapping, Sequence

import pandas as pd

from capsule.figures import points
from capsule.report import answers, tables, words
from capsule.report.provenance import Origin, origin_of

RESULT = "leave_one_out"


def overview(index: pd.DataFrame, passed_over: pd.DataFrame) -> dict:
    """Say how many recordings there are, where they come from and what could not be used.

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
        "rejected": rejected[["recording", "reason"]].fillna("").to_dict("records"),
        "passed_over": passed_over[["path", "reason"]].fillna("").to_dict("records"),
    }


def _origin_words(origin: Origin) -> dict:
    """Say where the recordings come from, in a headline and a sentence."""
    total = origin.simulated + origin.recorded + origin.silent
    match origin.kind:
        case "simulated":
            headline = "Simulated recordings"
            text = (
                f"Every one of the {words.plural(total, 'recording')} was made by a simulator. "
                "These numbers show how the method behaves on simulated signals; they say nothing "
                "about how well a real capsule finds nodules."
            )
        case "recorded":
            headline = "Recorded data"
            text = f"All {words.plural(total, 'recording')} name a source that is no simulator."
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
                "Rates over such a mixture belong to neither; separate them to judge the capsule."
            )
        case "unknown":
            headline = "Origin not stated"
            text = (
                "No recording names its source; write a line such as “# source: bench 2” at the "
                "top of each file."
            )
        case _:
            headline = "No recordings"
            text = "There is no usable recording under raw/."
    sources = [f"{name} ({count})" for name, count in origin.sources.items()]
    return {"headline": headline, "text": text, "sources": sources}


def answer_cards(
    ours: Mapping[str, pd.DataFrame],
    paper: Mapping[str, pd.DataFrame],
    predictions: pd.DataFrame,
    settings: Mapping,
    printed_tolerance_mm: float,
) -> list[dict]:
    """Answer the questions that a reader brings, each with interval and the paper's answer.

    Parameters
    ----------
    ours, paper : mapping of str to DataFrame
        ``detection``, ``specificity`` and ``sizing`` of one detector and scheme, and the paper's.
    predictions : DataFrame
        The verdicts of that detector and scheme.
    settings : mapping
        Sections ``evaluation`` and ``report`` of the configuration.
    printed_tolerance_mm : float
        The tolerance of the paper's rates.

    Returns
    -------
    list of dict
        ``id``, ``question``, ``answer``, ``value``, ``detail`` and ``paper``.
    """
    confidence, level = settings["evaluation"]["confidence"], settings["report"]["reliable_rate"]
    tolerance = settings["evaluation"]["tolerance_mm"]
    smallest = answers.smallest_reliable_size(ours["detection"], level)
    healthy = answers.specificity(ours["specificity"])
    healthy_paper = answers.specificity(paper["specificity"])
    within = answers.within_tolerance(ours["sizing"], confidence)
    error = answers.mean_size_error(predictions, confidence)
    return [
        {
            "id": "smallest",
            "question": "Smallest size reliably found",
            "answer": "none" if smallest is None else words.size(smallest),
            "value": smallest,
            "detail": _rates_at(ours["detection"], smallest)
            + f"Reliable: precision and recall of at least {words.percent(level)}, there and at "
            "every larger size.",
            "paper": _paper_smallest(paper["detection"], level),
        },
        {
            "id": "specificity",
            "question": "Specificity",
            "answer": words.percent(healthy.value),
            "value": healthy.value,
            "detail": _specificity_words(healthy),
            "paper": f"{words.percent(healthy_paper.value)} "
            f"({words.interval(healthy_paper.low, healthy_paper.high)}), worked out from its "
            "counts; it does not print it",
        },
        {
            "id": "within",
            "question": f"Size right within {tolerance:g} mm",
            "answer": words.percent(within.value),
            "value": within.value,
            "detail": f"{words.interval(within.low, within.high)}; "
            f"{words.count_of(within.hits, within.of)} recordings of nodules."
            if within.of
            else "There is no recording of a nodule.",
            "paper": _paper_within(
                ours["sizing"], paper["sizing"], confidence, tolerance == printed_tolerance_mm
            ),
        },
        {
            "id": "error",
            "question": "Mean error of the size",
            "answer": f"{words.number(error.value)} mm" if error.of else words.UNKNOWN,
            "value": error.value,
            "detail": _error_words(error),
            "paper": "not given",
        },
    ]


def summary(origin: str, accepted: int, cards: Sequence[Mapping], settings: Mapping) -> str:
    """Answer in a sentence or two.

    Parameters
    ----------
    origin : str
        Kind of origin, from `capsule.report.provenance.Origin`.
    accepted : int
        How many recordings were used.
    cards : sequence of mapping
        From `answer_cards`.
    settings : mapping
        Section ``evaluation`` of the configuration.

    Returns
    -------
    str
    """
    by_id = {card["id"]: card for card in cards}
    smallest, healthy = by_id["smallest"], by_id["specificity"]
    kind = "simulated recording" if origin == "simulated" else "recording"
    on = f"On {words.plural(accepted, kind)}"
    if smallest["value"] is None:
        found = f"{on}, no nodule size is reliably found"
    else:
        found = f"{on}, nodules of {smallest['answer']} and larger are reliably found"
    if words.is_known(healthy["value"]):
        share = words.percent(1 - healthy["value"])
        found += f"; where there is none, one is reported in {share} of the runs"
    if words.is_known(by_id["within"]["value"]):
        tolerance = f"{settings['tolerance_mm']:g} mm"
        found += f". The size is right within {tolerance} in {by_id['within']['answer']}"
    return found + "."


def _rates_at(detection: pd.DataFrame, size_mm: float | None) -> str:
    if size_mm is None:
        return ""
    row = detection[detection["size_mm"] == size_mm].iloc[0]
    precision = words.interval(row["precision_low"], row["precision_high"])
    recall = words.interval(row["recall_low"], row["recall_high"])
    return (
        f"There, precision {words.percent(row['precision'])} ({precision}) and recall "
        f"{words.percent(row['recall'])} ({recall}). "
    )


def _paper_smallest(detection: pd.DataFrame, level: float) -> str:
    smallest = answers.smallest_reliable_size(detection, level)
    return "none" if smallest is None else f"{words.size(smallest)}, by the same rule"


def _specificity_words(healthy: answers.Estimate) -> str:
    if not healthy.of:
        return "There is no recording without a nodule."
    return (
        f"{words.interval(healthy.low, healthy.high)}; "
        f"{words.count_of(healthy.hits, healthy.of)} recordings without a nodule were called so."
    )


def _paper_within(
    ours: pd.DataFrame, paper: pd.DataFrame, confidence: float, same_tolerance: bool
) -> str:
    sizes_mm = sorted(paper["size_mm"])
    printed = answers.within_tolerance(paper, confidence)
    named = words.enumerate_words([f"{size_mm:g}" for size_mm in sizes_mm])
    text = (
        f"{words.percent(printed.value)} ({words.interval(printed.low, printed.high)}) over "
        f"{named} mm"
    )
    if not same_tolerance:
        return f"{text}, with another tolerance"
    if not set(sizes_mm) <= set(ours["size_mm"]):
        return f"{text}; this archive lacks some of these sizes"
    same = answers.within_tolerance(ours, confidence, sizes_mm)
    return f"{text}; here over the same sizes {words.percent(same.value)}"


def _error_words(error: answers.Estimate) -> str:
    if not error.of:
        return "There is no recording of a nodule."
    bounds = f"{words.number(error.low)} to {words.number(error.high)} mm; "
    mean = f"mean of {words.plural(error.of, 'recording')}, a missed nodule counting as 0 mm."
    return (bounds if words.is_known(error.low) else "") + mean


def rate_tables(
    detection: pd.DataFrame,
    sizing: pd.DataFrame,
    confusion: pd.DataFrame,
    sizes_mm: Sequence[float],
    settings: Mapping,
) -> dict:
    """Make the tables of detection, of the negatives and of sizing, the paper's beside ours."""
    tolerance, confidence = settings["tolerance_mm"], settings["confidence"]
    measures = {"exact_rate": "Exact size", "within_rate": f"Within {tolerance:g} mm"}
    sized = tables.rate_table(points.sizing_points(sizing), measures, sizes_mm[1:])
    errors = {
        (row.scheme, row.size_mm): row.mean_absolute_error_mm
        for row in sizing.itertuples(index=False)
        if row.scheme != "paper"
    }
    schemes = list(dict.fromkeys(scheme for scheme, _ in errors))
    sized["groups"].append(
        {"title": "Mean absolute error", "schemes": [words.scheme(name) for name in schemes]}
    )
    for row in sized["rows"]:
        for name in schemes:
            row["cells"].append(_error_cell(errors.get((name, row["size_mm"])), name))
    measures = {"precision": "Precision", "recall": "Recall"}
    negatives = points.negative_points(confusion, confidence)
    return {
        "detection": tables.rate_table(points.detection_points(detection), measures, sizes_mm[1:]),
        "negatives": tables.rate_table(
            negatives, {"classified": "Share of the recordings without a nodule"}, sizes_mm
        ),
        "sizing": sized,
    }


def _error_cell(value: float | None, scheme: str) -> dict:
    known = words.is_known(value)
    text = f"{words.number(value)} mm" if known else words.UNKNOWN
    value = float(value) if known else None
    return {"value": value, "text": text, "interval": "", "count": "", "scheme": scheme}
