"""Make each detector's section of the page: answers, rates beside the paper's, confusions."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property

import pandas as pd

from capsule import words
from capsule.detectors.registry import PAPER, detector_row
from capsule.evaluation.confounded import Confounded, confounded_keys, in_words
from capsule.evaluation.cross_validation import LEAVE_ONE_OUT
from capsule.evaluation.lead import Lead, headline_confidence
from capsule.evaluation.measures import predictive, summary
from capsule.evaluation.paper import TABLES, Evaluation
from capsule.evaluation.rates import of_each, rate_tables
from capsule.held_out import places_of
from capsule.kinds import Cells, Settings
from capsule.page import answers, cards, cells, provenance, schemes, trust

# The tables of a detector and a scheme that its answers need, besides those of `Evaluation`.
_COMPARED = ("summary", "predictive_values")


@dataclass(frozen=True)
class Rates:
    """All tables of rates, with the recordings behind them.

    Attributes
    ----------
    evaluation : Evaluation
        The rates, ours and the paper's.
    judgements : mapping of str to DataFrame
        The tables that compare the detectors, by name.
    index : DataFrame
        results/recordings.csv.
    settings : mapping
        The configuration.
    """

    evaluation: Evaluation
    judgements: Mapping[str, pd.DataFrame]
    index: pd.DataFrame
    settings: Settings

    @property
    def held_out(self) -> list[str]:
        """Return the sessions that are held out."""
        return list(self.settings["evaluation"].get("held_out", ()))

    @property
    def schemes(self) -> list[str]:
        """Return the schemes of the page; the first is shown first."""
        configured = self.settings["evaluation"]["schemes"]
        return schemes.shown_schemes(self.evaluation.predictions, configured)

    @cached_property
    def confounded(self) -> list[Confounded]:
        """Return the keys of the header from which nodules or their sizes follow."""
        return confounded_keys(_rows_of(self.index), self.held_out)

    def recordings(self, scheme: str) -> tuple[pd.DataFrame, pd.DataFrame]:
        """Return the rows of the index that a scheme judges, and those that teach."""
        return schemes.judged_and_teaching(scheme, self.index, self.held_out)

    def of(self, detector: str, scheme: str) -> dict[str, pd.DataFrame]:
        """Return a detector's rows of all tables, by one scheme."""
        tables = {name: self.evaluation.tables[name] for name in TABLES}
        tables |= {name: self.judgements[name] for name in _COMPARED}
        return {
            name: table[(table["detector"] == detector) & (table["scheme"] == scheme)]
            for name, table in tables.items()
        }

    def at(self, detector: str, scheme: str, confidence: float) -> dict[str, pd.DataFrame]:
        """Return the tables of a detector with intervals of another level than the configured."""
        rules = {**self.settings["evaluation"], "confidence": confidence}
        rows = self.verdicts(detector, scheme)
        index = _rows_of(self.index[self.index["status"] == "accepted"])
        tables = rate_tables(rows, self.evaluation.sizes_mm(), rules, index)
        each = list(of_each(rows, index))
        made = {
            "summary": summary(each, rules["tolerance_mm"], confidence) if each else (),
            "predictive_values": (
                key | row
                for key, judged in each
                for row in predictive(judged, rules["prevalence"], confidence)
            ),
        }
        for name, rows_of in made.items():
            table = pd.DataFrame(rows_of, columns=None if each else self.judgements[name].columns)
            tables[name] = table[table["detector"] == detector]
        return tables

    def verdicts(self, detector: str, scheme: str) -> pd.DataFrame:
        """Return a detector's verdicts by one scheme."""
        rows = self.evaluation.predictions
        return rows[(rows["detector"] == detector) & (rows["scheme"] == scheme)]


def page_values(rates: Rates, lead: Lead, printed_tolerance_mm: float) -> Cells:
    """Return the page's values from the detectors' rates.

    Parameters
    ----------
    rates : Rates
        The tables.
    lead : Lead
        The leading detector.
    printed_tolerance_mm : float
        The tolerance of the paper's rates.

    Returns
    -------
    dict
        ``results`` are from `result_of`, the leading detector first, and ``lead_note`` says why it
        leads. ``headline_confidence`` is the level of its first intervals, corrected for the
        choice. ``rates_hold`` says for which recordings the rates of each scheme hold.
        ``figure_series`` are the detectors whose rates the figures show. The others are ``trust``
        (on single passes), ``summary``, ``sizes``, ``scheme_note`` and ``thresholds``.
    """
    evaluation, scheme = rates.evaluation, rates.schemes[0]
    judged, teaching = rates.recordings(scheme)
    rules = rates.settings["evaluation"]
    set_by = answers.set_specificity(
        healthy_places(teaching), rules["specificity"], rules["confidence"]
    )
    origin = provenance.origin_of(judged["source"].fillna("")).kind
    drawn = [f"{name} ({words.scheme(scheme)})" for name in dict.fromkeys([lead.detector, PAPER])]
    ours = answers_of(rates, lead.detector, scheme, lead)
    return {
        "results": [
            result_of(rates, detector, lead, printed_tolerance_mm)
            for detector in lead_first(evaluation.detectors(), lead)
        ],
        "lead_note": cards.lead_words(lead, scheme),
        "headline_confidence": words.percent(
            headline_confidence(lead, scheme, rules["confidence"])
        ),
        "trust": trust.trust_words(ours),
        "summary": cards.summary(origin, ours, lead.detector),
        "sizes": [words.size(size_mm) for size_mm in evaluation.sizes_mm()],
        "scheme_note": schemes.scheme_note(scheme),
        "thresholds": cards.threshold_words(rules["specificity"], set_by),
        "rates_hold": schemes.table_note(rates.schemes, rates.index, rates.held_out),
        "figure_series": words.enumerate_words([*drawn, "the paper"]),
    }


def lead_first(detectors: Iterable[str], lead: Lead) -> list[str]:
    """Return the detectors in the order of the page: the leading one, then the others."""
    return list(dict.fromkeys([lead.detector, *detectors]))


def result_of(rates: Rates, detector: str, lead: Lead, printed_tolerance_mm: float) -> Cells:
    """Return a detector's answers and tables.

    Parameters
    ----------
    rates : Rates
        The tables.
    detector : str
        Its name.
    lead : Lead
        The leading detector.
    printed_tolerance_mm : float
        The tolerance of the paper's rates.

    Returns
    -------
    dict
        ``detector``, ``words``, ``scheme``, ``cards``, ``confusions`` and the tables of rates.
    """
    evaluation, settings = rates.evaluation, rates.settings
    sizes_mm, scheme = evaluation.sizes_mm(), rates.schemes[0]
    both = {name: evaluation.of(name, detector, with_paper=True) for name in TABLES}
    sizing = both["sizing"]
    paper = answers.paper_answers(
        evaluation.paper, sizing[sizing["scheme"] == scheme], settings, printed_tolerance_mm
    )
    ours, method, also = answers_of(rates, detector, scheme, lead), None, None
    if detector != PAPER and PAPER in evaluation.detectors():
        method = answers_of(rates, PAPER, scheme)
    if scheme != LEAVE_ONE_OUT and LEAVE_ONE_OUT in rates.schemes:
        also = answers_of(rates, detector, LEAVE_ONE_OUT)
    return {
        "detector": detector,
        "words": detector_row(detector).sentence,
        "scheme": words.scheme(scheme),
        "cards": cards.answer_cards(ours, paper, method, also),
        "confusions": [
            {
                "title": words.scheme(name),
                "rows": cells.confusion_rows(both["confusion"], name, sizes_mm),
            }
            for name in rates.schemes
        ],
        **{
            name: {"detector": detector, **table}
            for name, table in cells.rate_tables(
                both["detection"], sizing, both["confusion"], sizes_mm, settings["evaluation"]
            ).items()
        },
    }


def answers_of(
    rates: Rates, detector: str, scheme: str, lead: Lead | None = None
) -> answers.Answers:
    """Return a detector's results by one scheme.

    Parameters
    ----------
    rates : Rates
        The tables.
    detector, scheme : str
        Their names.
    lead : Lead, optional
        The leading detector: its intervals are corrected for having been chosen.
    """
    rules = rates.settings["evaluation"]
    judged, teaching = rates.recordings(scheme)
    set_by = None
    if schemes.sets_specificity(detector, scheme):
        places = healthy_places(teaching)
        set_by = answers.set_specificity(places, rules["specificity"], rules["confidence"])
    scopes = (
        schemes.scope_of(judged[judged["size_mm"] > 0], teaching, scheme),
        schemes.scope_of(judged[judged["size_mm"] == 0], teaching, scheme),
    )
    tables, level = rates.of(detector, scheme), rules["confidence"]
    if lead and lead.detector == detector:
        level = headline_confidence(lead, scheme, level)
    if level != rules["confidence"]:
        tables = rates.at(detector, scheme, level)
    verdicts = rates.verdicts(detector, scheme)
    ours = answers.our_answers(tables, verdicts, rates.settings, level, scheme, scopes, set_by)
    return ours.if_confounded(in_words(rates.confounded))


def healthy_places(teaching: pd.DataFrame) -> int:
    """Return the number of healthy places that teach; passes over one place count once.

    Parameters
    ----------
    teaching : DataFrame
        Rows of results/recordings.csv.
    """
    places = places_of(_rows_of(teaching))
    able = (teaching["size_mm"] == 0) & teaching["no_verdict"].isna()
    return len({places[name] for name in teaching.loc[able, "recording"]})


def _rows_of(index: pd.DataFrame) -> dict[str, Cells]:
    """Return rows of results/recordings.csv by recording; what is not known is an empty text."""
    known = index.astype(object).where(index.notna(), "")
    return dict(zip(known["recording"], known.to_dict("records"), strict=True))
