"""The rates that the page shows: of which detector first, by which scheme, and where they hold."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pandas as pd

from capsule import words
from capsule.detectors.registry import DETECTORS
from capsule.evaluation.columns import RATES
from capsule.evaluation.confounded import Confounded, confounded_keys
from capsule.evaluation.cross_validation import (
    HELD_OUT,
    LEAST_GROUPS,
    LEAVE_ONE_OUT,
    RESUBSTITUTION,
    choosing_scheme,
    group_scheme,
)
from capsule.evaluation.measures import measure_tables
from capsule.evaluation.paper import Evaluation
from capsule.evaluation.rates import of_any
from capsule.kinds import Cells, Settings
from capsule.recordings.held_out import is_held_out
from capsule.recordings.origin import places_of

# Scheme of an unlabelled recording: all labelled recordings teach.
ALL = "all"
LEAVE_ONE_SETUP_OUT = group_scheme("setup")
# The order of the page: what is measured on recordings that taught nothing stands first.
_ORDER = (HELD_OUT, LEAVE_ONE_OUT)
# The tables of a detector and a scheme that its answers need.
_OF_ANSWERS = (*RATES, "summary")


@dataclass(frozen=True)
class Rates:
    """All tables of rates, with the recordings behind them.

    Attributes
    ----------
    evaluation : Evaluation
        The rates, ours and the paper's.
    index : DataFrame
        results/recordings.csv.
    settings : mapping
        The configuration.
    """

    evaluation: Evaluation
    index: pd.DataFrame
    settings: Settings

    @property
    def held_out(self) -> list[str]:
        """Return the sessions that are held out."""
        return list(self.settings["evaluation"].get("held_out", ()))

    @property
    def schemes(self) -> list[str]:
        """Return the schemes with verdicts, or those configured, in the order of the page."""
        judged = self.evaluation.predictions["scheme"].unique().tolist()
        judged = judged or list(self.settings["evaluation"]["schemes"])
        first = [name for name in _ORDER if name in judged]
        return first + [name for name in judged if name not in first]

    @cached_property
    def confounded(self) -> list[Confounded]:
        """Return the keys of the header from which nodules or their sizes follow."""
        return confounded_keys(_rows_of(self.index), self.held_out)

    def recordings(self, scheme: str) -> tuple[pd.DataFrame, pd.DataFrame]:
        """Return the rows of the accepted labelled recordings that a scheme judges, and teaches."""
        labelled = self.index[(self.index["status"] == "accepted") & self.index["size_mm"].notna()]
        sessions = labelled.get("session", [None] * len(labelled))
        pairs = zip(labelled["recording"], sessions, strict=True)
        held_out = np.array([is_held_out(*pair, self.held_out) for pair in pairs], dtype=bool)
        teaching = labelled[~held_out]
        return (labelled[held_out] if scheme == HELD_OUT else teaching), teaching

    def healthy_places(self, scheme: str) -> int:
        """Return the number of healthy places that teach; passes over one place count once."""
        _, teaching = self.recordings(scheme)
        places = places_of(_rows_of(teaching))
        able = (teaching["size_mm"] == 0) & teaching["no_verdict"].isna()
        return len({places[name] for name in teaching.loc[able, "recording"]})

    def scopes(self, scheme: str) -> tuple["Scope", "Scope"]:
        """Return for what the rates of nodules and of healthy recordings hold, by one scheme."""
        judged, teaching = self.recordings(scheme)
        nodules, healthy = judged[judged["size_mm"] > 0], judged[judged["size_mm"] == 0]
        return scope_of(nodules, teaching, scheme), scope_of(healthy, teaching, scheme)

    def of(self, detector: str, scheme: str) -> dict[str, pd.DataFrame]:
        """Return a detector's rows of all tables, by one scheme."""
        of_detector = {name: self.evaluation.of(name, detector) for name in _OF_ANSWERS}
        return {name: rows[rows["scheme"] == scheme] for name, rows in of_detector.items()}

    def at(self, detector: str, scheme: str, confidence: float) -> dict[str, pd.DataFrame]:
        """Return the tables of a detector with intervals of another level than the configured."""
        rules = {**self.settings["evaluation"], "confidence": confidence}
        tables = measure_tables(
            self.verdicts(detector, scheme),
            self.evaluation.sizes_mm(),
            rules,
            self.accepted_rows(),
            _OF_ANSWERS,
        )
        return {name: table[table["detector"] == detector] for name, table in tables.items()}

    def accepted_rows(self) -> dict[str, Cells]:
        """Return the rows of the accepted recordings by name."""
        return _rows_of(self.index[self.index["status"] == "accepted"])

    def verdicts(self, detector: str, scheme: str) -> pd.DataFrame:
        """Return a detector's verdicts by one scheme."""
        rows = self.evaluation.predictions
        return rows[(rows["detector"] == detector) & (rows["scheme"] == scheme)]


def sets_specificity(detector: str, scheme: str) -> bool:
    """Return whether the specificity is that of the threshold, and not measured.

    A learned threshold is the score of a rank among the healthy places. Leaving one of these out
    gives the same share of false alarms for any scores that the fold does not change.
    """
    row = DETECTORS.get(detector)
    learned = row is not None and row.fixed_threshold is None
    return learned and scheme in (LEAVE_ONE_OUT, RESUBSTITUTION)


@dataclass(frozen=True)
class Scope:
    """The recordings for which the rates of a class hold, from the set-ups in the headers.

    `setups` were judged; None if a recording names none. The rates hold over new set-ups if at
    least `LEAST_GROUPS` were judged, and none of them taught.
    """

    setups: int | None
    new: bool

    def text(self) -> str:
        """Return for what the rates hold, such as ``over new set-ups``."""
        said = "over new set-ups" if self.new else "for further runs of these set-ups"
        if self.setups is None:
            return said
        return f"{said} ({self.setups} {'was' if self.setups == 1 else 'were'} judged)"


def scope_of(judged: pd.DataFrame, teaching: pd.DataFrame, scheme: str) -> Scope:
    """Return for what the rates of some recordings hold, by a scheme.

    The rows of results/recordings.csv are those of the judged recordings of one class, healthy or
    with a nodule, and those of all labelled recordings that teach.
    """
    if judged.empty or "setup" not in judged or judged["setup"].isna().any():
        return Scope(None, False)
    setups = set(judged["setup"])
    apart = scheme == LEAVE_ONE_SETUP_OUT or (
        scheme == HELD_OUT and setups.isdisjoint(teaching["setup"].dropna())
    )
    return Scope(len(setups), apart and len(setups) >= LEAST_GROUPS)


@dataclass(frozen=True)
class Lead:
    """The leading detector, and whether the configuration names it.

    ``sensitivity`` is that at the configured specificity, on which the choice rests; NaN if it is
    unknown. ``compared`` is a number of detectors.
    """

    detector: str
    named: bool
    sensitivity: float
    compared: int


def headline_confidence(lead: Lead, scheme: str, confidence: float) -> float:
    """Return the level of the leading detector's intervals, after which their promise holds.

    The best of several detectors looks better than it is. The intervals of all of them hold at once
    if each has the level ``1 - (1 - confidence) / number compared`` (Bonferroni 1936), so they also
    hold for the best one, whichever it is. A detector that the configuration names was not chosen
    by its rates. Under the scheme of held-out sessions, the recordings had no part in the choice.
    """
    if lead.named or scheme == HELD_OUT:
        return confidence
    return 1 - (1 - confidence) / max(lead.compared, 1)


def leading(
    summary: pd.DataFrame, detectors: Sequence[str], schemes: Sequence[str], named: str
) -> Lead:
    """Return the detector whose verdicts the report shows first.

    All detectors are compared at the same share of false alarms. The specificity of a learned
    threshold is set, so it tells nothing of a detector.

    Parameters
    ----------
    summary : DataFrame
        results/evaluation/summary.csv.
    detectors, schemes : sequence of str
        Those of the evaluation. Of equally good detectors, the first leads. The scheme is the
        `choosing_scheme`.
    named : str
        The configured detector. Any other text selects the highest sensitivity at the specificity.
    """
    of_scheme = summary[summary["scheme"] == choosing_scheme(schemes)]
    of_scheme = of_any(of_scheme).set_index("detector")
    reached = of_scheme["sensitivity_at_specificity"].reindex(list(detectors)).astype(float)
    known = reached.dropna()
    # Of several that are equal, idxmax returns the first.
    best = str(known.idxmax()) if len(known) else detectors[0]
    detector = named if named in detectors else best
    return Lead(detector, named in detectors, float(reached[detector]), len(known))


def table_note(rates: Rates) -> str:
    """Return for what the rates of each scheme hold, for the captions of tables."""
    # Rates by resubstitution hold for nothing but the recordings themselves.
    schemes = [name for name in rates.schemes if name != RESUBSTITUTION]
    new = [name for name in schemes if all(each.new for each in rates.scopes(name))]
    old = [name for name in schemes if name not in new]
    parts = [
        f"{words.enumerate_words([words.scheme(name) for name in group])}: rates {text}."
        for group, text in ((new, Scope(None, True).text()), (old, Scope(None, False).text()))
        if group
    ]
    return " ".join(part[0].upper() + part[1:] for part in parts)


def _rows_of(index: pd.DataFrame) -> dict[str, Cells]:
    """Return rows of results/recordings.csv by recording; what is not known is an empty text."""
    known = index.astype(object).where(index.notna(), "")
    return dict(zip(known["recording"], known.to_dict("records"), strict=True))
