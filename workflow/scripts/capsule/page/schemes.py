"""Choose which scheme's rates the page shows first, and for which recordings such rates hold."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from capsule import words
from capsule.detectors.registry import DETECTORS
from capsule.evaluation.cross_validation import (
    HELD_OUT,
    LEAST_GROUPS,
    LEAVE_ONE_OUT,
    RESUBSTITUTION,
    group_scheme,
)
from capsule.held_out import is_held_out

LEAVE_ONE_SETUP_OUT = group_scheme("setup")
# The order of the page: what is measured on recordings that taught nothing stands first.
_ORDER = (HELD_OUT, LEAVE_ONE_OUT)


def shown_schemes(predictions: pd.DataFrame, configured: Sequence[str]) -> list[str]:
    """Return the schemes that have verdicts, in the order of the page; else the configured ones.

    Parameters
    ----------
    predictions : DataFrame
        results/evaluation/predictions.csv.
    configured : sequence of str
        ``evaluation.schemes`` of the configuration.
    """
    judged = predictions["scheme"].unique().tolist() or list(configured)
    first = [name for name in _ORDER if name in judged]
    return first + [name for name in judged if name not in first]


def standing_in(scheme: str, shown: Sequence[str]) -> list[str]:
    """Return the schemes whose verdict a recording has under a scheme, the first existing one.

    An unlabelled recording has one verdict for all schemes. A held-out recording always has the one
    of its own scheme, and the others have none by that scheme: their verdict by leaving out their
    place stands in.

    Parameters
    ----------
    scheme : str
        The wanted scheme.
    shown : sequence of str
        The schemes of the page.
    """
    return list(dict.fromkeys([scheme, "all", *(name for name in _ORDER if name in shown), *shown]))


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

    Attributes
    ----------
    setups : int or None
        Number of set-ups that were judged; None if a recording names none.
    new : bool
        Whether the rates hold over new set-ups: at least `LEAST_GROUPS` were judged, and none of
        them taught.
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
    """Return for what the rates of some recordings hold.

    Parameters
    ----------
    judged : DataFrame
        Rows of results/recordings.csv: the recordings of one class, healthy or with a nodule.
    teaching : DataFrame
        The rows of all labelled recordings that teach.
    scheme : str
        The scheme of the rates.
    """
    if judged.empty or "setup" not in judged or judged["setup"].isna().any():
        return Scope(None, False)
    setups = set(judged["setup"])
    apart = scheme == LEAVE_ONE_SETUP_OUT or (
        scheme == HELD_OUT and setups.isdisjoint(teaching["setup"].dropna())
    )
    return Scope(len(setups), apart and len(setups) >= LEAST_GROUPS)


def scheme_note(scheme: str) -> str:
    """Return what the results' scheme means, and how the paper's scheme compares."""
    if scheme == HELD_OUT:
        return (
            "The held-out sessions taught no detector and chose nothing. The paper's own "
            "evaluation is probably resubstitution."
        )
    if scheme == RESUBSTITUTION:
        return (
            "Results are resubstitution: the recording under test also teaches the detector. The "
            "detector judges new recordings worse. The paper's own evaluation is probably "
            "resubstitution too."
        )
    return (
        "Results are leave-one-out: the place under test does not teach, that is all recordings "
        "of its site, and near copies. The paper's own evaluation is probably resubstitution."
    )


def table_note(schemes: Sequence[str], index: pd.DataFrame, sessions: Collection[str]) -> str:
    """Return for what the rates of each scheme hold, for the captions of tables.

    Parameters
    ----------
    schemes : sequence of str
        The schemes of the table.
    index : DataFrame
        results/recordings.csv.
    sessions : collection of str
        The sessions that are held out.
    """
    # Rates by resubstitution hold for nothing but the recordings themselves.
    schemes = [name for name in schemes if name != RESUBSTITUTION]
    new = [name for name in schemes if all(each.new for each in _scopes(name, index, sessions))]
    old = [name for name in schemes if name not in new]
    parts = [
        f"{words.enumerate_words([words.scheme(name) for name in group])}: rates {text}."
        for group, text in ((new, Scope(None, True).text()), (old, Scope(None, False).text()))
        if group
    ]
    return " ".join(part[0].upper() + part[1:] for part in parts)


def _scopes(scheme: str, index: pd.DataFrame, sessions: Collection[str]) -> list[Scope]:
    judged, teaching = judged_and_teaching(scheme, index, sessions)
    return [
        scope_of(judged[judged["size_mm"] > 0], teaching, scheme),
        scope_of(judged[judged["size_mm"] == 0], teaching, scheme),
    ]


def judged_and_teaching(
    scheme: str, index: pd.DataFrame, sessions: Collection[str]
) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Return the rows of the accepted labelled recordings: those that are judged, and that teach.

    Parameters
    ----------
    scheme : str
        The scheme.
    index : DataFrame
        results/recordings.csv.
    sessions : collection of str
        The sessions that are held out.
    """
    labelled = index[(index["status"] == "accepted") & index["size_mm"].notna()]
    held_out = np.array(
        [
            is_held_out(row["recording"], row.get("session"), sessions)
            for row in labelled.to_dict("records")
        ],
        dtype=bool,
    )
    teaching = labelled[~held_out]
    return (labelled[held_out] if scheme == HELD_OUT else teaching), teaching
