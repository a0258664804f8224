"""Make each detector's section of the page: answers, rates beside the paper's, confusions."""

import math
from collections.abc import Iterable

import pandas as pd

from capsule import words
from capsule.detectors.registry import PAPER, detector_row
from capsule.evaluation.beside_paper import TABLES, Evaluation
from capsule.evaluation.folds import RESUBSTITUTION, main_scheme
from capsule.evaluation.lead import Lead
from capsule.kinds import Cells, Settings
from capsule.page import answers, cards, cells, provenance, trust


def page_values(
    evaluation: Evaluation,
    index: pd.DataFrame,
    lead: Lead,
    settings: Settings,
    printed_tolerance_mm: float,
) -> Cells:
    """Return the page's values from the detectors' rates.

    Parameters
    ----------
    evaluation : Evaluation
        The tables.
    index : DataFrame
        results/recordings.csv.
    lead : Lead
        The leading detector.
    settings : mapping
        The configuration.
    printed_tolerance_mm : float
        The tolerance of the paper's rates.

    Returns
    -------
    dict
        ``results`` (from `result_of`, the leading detector first), ``lead_note`` (why it leads),
        ``trust``, ``summary``, ``sizes``, ``few_healthy``, ``scheme_note`` and ``figure_series``
        (the detectors whose rates the figures show).
    """
    scheme = main_scheme(settings["evaluation"]["schemes"])
    labelled = index[(index["status"] == "accepted") & index["size_mm"].notna()]
    origin = provenance.origin_of(labelled["source"].fillna("")).kind
    drawn = [f"{name} ({words.scheme(scheme)})" for name in dict.fromkeys([lead.detector, PAPER])]
    return {
        "results": [
            result_of(evaluation, detector, settings, printed_tolerance_mm)
            for detector in lead_first(evaluation.detectors(), lead)
        ],
        "lead_note": cards.lead_words(lead, scheme),
        "trust": trust.trust_words(
            _verdicts_of(evaluation, lead.detector, scheme),
            scheme,
            settings["evaluation"]["confidence"],
            origin,
        ),
        "summary": cards.summary(
            origin, len(labelled), answers_of(evaluation, lead.detector, settings), lead.detector
        ),
        "sizes": [words.size(size_mm) for size_mm in evaluation.sizes_mm()],
        "few_healthy": few_healthy(
            int((labelled["size_mm"] == 0).sum()), settings["evaluation"]["specificity"]
        ),
        "scheme_note": scheme_note(scheme),
        "figure_series": words.enumerate_words([*drawn, "the paper"]),
    }


def lead_first(detectors: Iterable[str], lead: Lead) -> list[str]:
    """Return the detectors in the order of the page: the leading one, then the others."""
    return list(dict.fromkeys([lead.detector, *detectors]))


def result_of(
    evaluation: Evaluation, detector: str, settings: Settings, printed_tolerance_mm: float
) -> Cells:
    """Return a detector's answers and tables.

    Parameters
    ----------
    evaluation : Evaluation
        The tables.
    detector : str
        Its name.
    settings : mapping
        The configuration.
    printed_tolerance_mm : float
        The tolerance of the paper's rates.

    Returns
    -------
    dict
        ``detector``, ``words``, ``scheme``, ``cards``, ``confusions`` and the tables of rates.
    """
    judged, sizes_mm = settings["evaluation"], evaluation.sizes_mm()
    scheme = main_scheme(judged["schemes"])
    both = {name: evaluation.of(name, detector, with_paper=True) for name in TABLES}
    sizing = both["sizing"]
    paper = answers.paper_answers(
        evaluation.paper, sizing[sizing["scheme"] == scheme], settings, printed_tolerance_mm
    )
    method = None
    if detector != PAPER and PAPER in evaluation.detectors():
        method = answers_of(evaluation, PAPER, settings)
    return {
        "detector": detector,
        "words": detector_row(detector).sentence,
        "scheme": words.scheme(scheme),
        "cards": cards.answer_cards(answers_of(evaluation, detector, settings), paper, method),
        "confusions": [
            {
                "title": words.scheme(name),
                "rows": cells.confusion_rows(both["confusion"], name, sizes_mm),
            }
            for name in judged["schemes"]
        ],
        **{
            name: {"detector": detector, **table}
            for name, table in cells.rate_tables(
                both["detection"], sizing, both["confusion"], sizes_mm, judged
            ).items()
        },
    }


def answers_of(evaluation: Evaluation, detector: str, settings: Settings) -> answers.Answers:
    """Return a detector's results, by the page's main scheme.

    Parameters
    ----------
    evaluation : Evaluation
        The tables.
    detector : str
        Its name.
    settings : mapping
        The configuration.
    """
    scheme = main_scheme(settings["evaluation"]["schemes"])
    tables = {name: evaluation.of(name, detector) for name in TABLES}
    tables = {name: table[table["scheme"] == scheme] for name, table in tables.items()}
    verdicts = _verdicts_of(evaluation, detector, scheme)
    return answers.our_answers(tables, verdicts, settings)


def _verdicts_of(evaluation: Evaluation, detector: str, scheme: str) -> pd.DataFrame:
    verdicts = evaluation.predictions
    return verdicts[(verdicts["detector"] == detector) & (verdicts["scheme"] == scheme)]


def scheme_note(scheme: str) -> str:
    """Return what the results' scheme means, and how the paper's scheme compares."""
    if scheme == RESUBSTITUTION:
        return (
            "Results are resubstitution: the recording under test also teaches the detector. The "
            "detector judges new recordings worse. The paper's own evaluation is probably "
            "resubstitution too."
        )
    return (
        "Results are leave-one-out: the recordings that teach exclude the one under test. "
        "The paper's own evaluation is probably resubstitution."
    )


def few_healthy(healthy: int, specificity: float) -> str:
    """Return a warning if too few recordings without a nodule exist for the wanted specificity.

    Parameters
    ----------
    healthy : int
        Number of recordings without a nodule.
    specificity : float
        The specificity at which learned thresholds aim.

    Returns
    -------
    str
        Empty if there are enough recordings, or none.
    """
    needed = math.ceil(specificity / (1 - specificity) - 1e-9)
    if healthy == 0 or healthy >= needed:
        return ""
    return (
        f"A specificity of {words.percent(specificity)} needs {needed} recordings without a "
        f"nodule; this archive has {healthy}. With so few, the threshold is their largest score."
    )
