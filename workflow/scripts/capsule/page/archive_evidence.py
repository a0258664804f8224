"""Collect what the page shows of each recording, small enough for a thousand recordings.

What neither its fit nor another recording changes is made by jobs of its own
(`capsule.page.recording_evidence`). The report adds the fit, the verdicts and the templates.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Protocol

from capsule.arrays import FloatArray
from capsule.kinds import Cells, Row, Settings
from capsule.page import recordings
from capsule.page.nearest_templates import NearestTemplate, nearest_templates
from capsule.page.packing import inflated, rounded, to_json
from capsule.page.provenance import fit_words
from capsule.particle import Particle, peak_positions

# A recording's row from `capsule.page.recordings.unjudged_rows`, and its place among all rows.
PlacedRow = tuple[int, Row]

# The numbers of a recording's fit, and Theta*.
Fit = tuple[Row, Particle]

VERDICT_KEYS = (
    *("detector", "scheme", "predicted_mm", "details", "distances"),
    *("score", "threshold", "location_mm"),
)


class Stored(Protocol):
    """The stored results of the accepted recordings."""

    def drawn(self, name: str) -> str:
        """Return what the page shows of the recording alone, as deflated JSON."""

    def quality(self, name: str) -> str:
        """Return the recording's quality in words."""

    def matrix(self, name: str) -> FloatArray:
        """Return the recording's matrix V, (S, L)."""

    def fit(self, name: str) -> Fit | None:
        """Return the recording's fit; None if it has none."""

    def templates(self, name: str) -> Mapping[str, Mapping[float, Particle]]:
        """Return the averaged particles of each scheme that judged it, by size in mm."""


@dataclass(frozen=True)
class Evidence:
    """The two parts of what the page shows of one recording.

    Attributes
    ----------
    name : str
        The recording.
    alone : str
        From `capsule.page.recording_evidence.recording_evidence`, as deflated JSON.
    among_others : str
        From `evidence_among_others`, as JSON.
    """

    name: str
    alone: str
    among_others: str

    def joined(self) -> str:
        """Return both parts as one JSON object."""
        return f"{inflated(self.alone)[:-1]},{self.among_others[1:]}"


def surface(particle: Particle, first_peak: float, lag: int, length: int) -> Cells:
    """Return the values from which the page draws a particle over a recording (eq. G, eq. RMSE).

    Parameters
    ----------
    particle : Particle
        The parameters.
    first_peak : float
        u.
    lag : int
        tau in 1..2L; at L + 1 the particle is not shifted.
    length : int
        L.

    Returns
    -------
    dict
        For each surface: ``amplitude``, ``vertical`` (sigma^ver), ``peak`` (in samples from the
        first reading) and ``horizontal`` (sigma^hor). ``from`` and ``to`` are the samples between
        which the particle lies.
    """
    shift = lag - (length + 1)
    peaks = peak_positions(particle.peak_spacing, first_peak) - 1 + shift
    return {
        "amplitude": rounded(particle.amplitude),
        "vertical": rounded(particle.vertical_spread),
        "peak": rounded(peaks),
        "horizontal": rounded(particle.horizontal_spread),
        "from": shift,
        "to": shift + length,
    }


def evidence_among_others(
    row: Row,
    place: int,
    verdicts: Sequence[Row],
    nearest: Mapping[str, NearestTemplate],
    fit: Fit | None,
    settings: Settings,
) -> Cells:
    """Return what the page shows of one recording because of its fit and the other recordings.

    Parameters
    ----------
    row : mapping
        From `capsule.page.recordings.unjudged_rows`.
    place : int
        The place of this row.
    verdicts : sequence of mapping
        Each detector's verdict, from `capsule.page.recordings.in_words`.
    nearest : mapping of str to NearestTemplate
        The nearest template under each scheme.
    fit : Fit or None
        The recording's fit; None if it has none.
    settings : mapping
        The configuration.

    Returns
    -------
    dict
        Ready for `to_json`: ``title``, ``row``, ``nodule_at_mm``, ``fitted`` (from
        `surface`), ``fit`` (in words), ``templates`` (from `surface`) and
        ``verdicts``. ``fitted`` and ``fit`` are None without a fit.
    """
    first_peak, length = settings["fit"]["first_peak"], settings["preprocessing"]["length"]
    fitted = in_words = None
    if fit:
        numbers, particle = fit
        fitted = surface(particle, numbers["first_peak"], numbers["lag"], length)
        in_words = fit_words(numbers)
    return {
        "title": recordings.truth(row),
        "row": place,
        "nodule_at_mm": row["nodule_at_mm"],
        "fitted": fitted,
        "fit": in_words,
        "templates": {
            scheme: {
                "size_mm": each.size_mm,
                **surface(each.particle, first_peak, each.lag, length),
            }
            for scheme, each in nearest.items()
        },
        "verdicts": [{key: verdict[key] for key in VERDICT_KEYS} for verdict in verdicts],
    }


def accepted_rows(rows: Iterable[Row]) -> list[PlacedRow]:
    """Return the recordings that have evidence; rejected recordings are left out."""
    return [(place, row) for place, row in enumerate(rows) if row["accepted"]]


def archive_evidence(
    rows: Iterable[PlacedRow],
    verdicts: Mapping[str, Sequence[Row]],
    sizes_mm: Sequence[float],
    stored: Stored,
    settings: Settings,
) -> Iterator[Evidence]:
    """Yield what the page shows of each recording, one at a time.

    Parameters
    ----------
    rows : iterable of PlacedRow
        Some of `accepted_rows`.
    verdicts : mapping of str to sequence of mapping
        From `capsule.page.recordings.verdicts_by_recording`.
    sizes_mm : sequence of float
        Sizes of the templates whose distances the verdicts hold, 0 first.
    stored : Stored
        The stored results.
    settings : mapping
        The configuration.

    Yields
    ------
    Evidence
    """
    for place, row in rows:
        name = row["recording"]
        said = [recordings.in_words(each, sizes_mm[-1]) for each in verdicts.get(name, [])]
        matrix = partial(stored.matrix, name)
        nearest = nearest_templates(stored.templates(name), said, sizes_mm, matrix, settings)
        content = evidence_among_others(row, place, said, nearest, stored.fit(name), settings)
        yield Evidence(name, stored.drawn(name), to_json(content))
