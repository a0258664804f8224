"""What the page says of each detector, and of each recording."""

import math
from collections.abc import Mapping

import pandas as pd

from capsule import words
from capsule.detectors.registry import detector_row
from capsule.evaluation.beside_paper import TABLES, Evaluation
from capsule.evaluation.folds import main_scheme
from capsule.page import cards, cells, evidence, provenance, recordings


def results_of(evaluation: Evaluation, settings: Mapping, printed_tolerance_mm: float) -> list:
    """Give each detector's answers and tables; the first is the paper's method.

    Parameters
    ----------
    evaluation : Evaluation
        The tables.
    settings : mapping
        The configuration.
    printed_tolerance_mm : float
        The tolerance of the paper's rates.

    Returns
    -------
    list of dict
        ``detector``, ``scheme``, ``cards``, the tables of rates and ``confusions``.
    """
    sizes_mm, judged = evaluation.sizes_mm(), settings["evaluation"]
    scheme = main_scheme(judged["schemes"])
    found = []
    for detector in evaluation.detectors():
        both = {name: evaluation.of(name, detector, with_paper=True) for name in TABLES}
        ours = {name: table[table["scheme"] == scheme] for name, table in both.items()}
        rows = evaluation.predictions
        rows = rows[(rows["detector"] == detector) & (rows["scheme"] == scheme)]
        confusions = [
            {
                "title": words.scheme(name),
                "rows": cells.confusion_rows(both["confusion"], name, sizes_mm),
            }
            for name in judged["schemes"]
        ]
        found.append(
            {
                "detector": detector,
                "words": detector_row(detector).sentence,
                "scheme": words.scheme(scheme),
                "cards": cards.answer_cards(
                    ours, evaluation.paper, rows, settings, printed_tolerance_mm
                ),
                "confusions": confusions,
                **cells.rate_tables(
                    both["detection"], both["sizing"], both["confusion"], sizes_mm, judged
                ),
            }
        )
    return found


def judgement(
    evaluation: Evaluation,
    index: pd.DataFrame,
    verdicts: Mapping[str, list[dict]],
    settings: Mapping,
    printed: Mapping,
) -> dict:
    """Give the page's values that follow from the recordings and what was said of them.

    Parameters
    ----------
    evaluation : Evaluation
        The tables.
    index : DataFrame
        results/recordings.csv.
    verdicts : mapping of str to list of dict
        From `capsule.page.recordings.verdicts_by_recording`.
    settings : mapping
        The configuration.
    printed : mapping
        Content of paper.yaml.

    Returns
    -------
    dict
    """
    results = results_of(evaluation, settings, printed["sizing_tolerance_mm"])
    judged, sizes_mm = settings["evaluation"], evaluation.sizes_mm()
    rows = recordings.recording_rows(
        index,
        verdicts,
        results[0]["detector"],
        main_scheme(judged["schemes"]),
        judged["tolerance_mm"],
    )
    shown = [row for row in rows if row["accepted"]]
    checksums = {row["recording"]: row["sha256"] for row in rows if row["sha256"]}
    # A nodule says more at first sight than a run without.
    first = next((row for row in shown if row["size_mm"]), shown[0] if shown else None)
    present = {row["outcome"] for row in rows}
    return {
        "results": results,
        "summary": cards.summary(
            provenance.origin_of(
                index.loc[index["status"] == "accepted", "source"].fillna("")
            ).kind,
            len(shown),
            results[0]["cards"],
            judged,
        ),
        "sizes": [words.size(size_mm) for size_mm in sizes_mm],
        "recordings": rows,
        "recording_sizes": list(dict.fromkeys(row["size"] for row in rows)),
        "outcomes": [name for name in recordings.OUTCOMES if name in present],
        "first_shown": first["recording"] if first else "",
        "data": evidence.to_json({"sizes": sizes_mm}),
        "few_healthy": few_healthy(
            int(((index["status"] == "accepted") & (index["size_mm"] == 0)).sum()),
            judged["specificity"],
        ),
        "tolerance": f"{judged['tolerance_mm']:g} mm",
        "confidence": words.percent(judged["confidence"]),
        "seed": settings["fit"]["seed"],
        "recordings_checksum": provenance.combined_checksum(checksums),
        "paper": printed,
        "bibtex": provenance.bibtex(printed),
    }


def few_healthy(healthy: int, specificity: float) -> str:
    """Say so where some threshold, but none that promises the specificity, can be learned."""
    needed = math.ceil(specificity / (1 - specificity) - 1e-9)
    if healthy == 0 or healthy >= needed:
        return ""
    return (
        f"{words.plural(healthy, 'recording')} without a nodule cannot promise a specificity of "
        f"{words.percent(specificity)}: that takes {needed}. Until then the threshold is the "
        "largest score among them."
    )
