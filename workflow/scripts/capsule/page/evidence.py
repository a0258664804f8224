"""Collect what the page shows of each recording, small enough for a thousand recordings.

What neither its fit nor another recording changes is made by jobs of its own
(`capsule.page.plot_data`). The report adds the fit, the verdicts and the templates.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cache, lru_cache
from typing import NamedTuple

import numpy as np
import pandas as pd

from capsule import words
from capsule.arrays import FloatArray
from capsule.detectors.registry import detector_row
from capsule.evaluation.cross_validation import folds_of, unlabelled_folds
from capsule.kinds import Cells, Row, Settings, Spread
from capsule.method.particle import Particle, particles_of, peak_positions, render
from capsule.method.sliding import RepeatedParticle, SlidingComparison
from capsule.method.templates import TemplateSet, build_templates, by_size, template_options
from capsule.page.packing import inflated, rounded, to_json
from capsule.page.rates import ALL
from capsule.page.recordings import known_or_none, seven_digits
from capsule.page.sketches import Felt
from capsule.recordings import names
from capsule.recordings.held_out import teaching
from capsule.recordings.names import sizes_of
from capsule.store import files
from capsule.store.results import PLOT_DATA, OfArchive, Results

# The columns with the evidence for a verdict.
EVIDENCE = ("score", "threshold", "location_mm")
# Most templates of a fold are those of all recordings: only the sizes left out differ.
_TEMPLATES_KEPT = 64
# Recordings of which one process makes what the page shows, in turn.
_IN_TURN = 100


class NearestTemplate(NamedTuple):
    """The nodule's template that is most similar to a recording: its size, particle and lag tau."""

    size_mm: float
    particle: Particle
    lag: int


class StoredRecordings:
    """The stored results of the accepted recordings of a run of the workflow.

    Parameters
    ----------
    results : Results
        The files of all recordings of the archive.
    settings : mapping
        The configuration.

    Attributes
    ----------
    drawn, qualities : mapping of str to str
        What the page shows of each recording alone, as deflated JSON, and its quality in words.
    templates : dict of str to dict
        The templates that judged a recording, from `fold_templates`.
    """

    def __init__(self, results: Results, settings: Settings) -> None:
        self._results, table = results, results.folder / OfArchive.RECORDINGS
        accepted = files.accepted_recordings(table)
        fitted = teaching(accepted, settings["evaluation"]["held_out"])
        self._fits = results.fits(name for name in fitted if names.size_mm(name))
        self._particles = particles_of(self._fits)
        taught = {
            name: particle
            for name, particle in self._particles.items()
            if not accepted[name]["no_verdict"]
        }
        templates = build_templates(by_size(taught), **template_options(settings))
        self.templates = fold_templates(templates, taught, accepted, settings["evaluation"])
        plot_data = results.described(PLOT_DATA, accepted, files.read_json)
        self.drawn: Mapping[str, str] = {name: each["drawn"] for name, each in plot_data.items()}
        self.qualities: Mapping[str, str] = {
            name: each["quality"] for name, each in plot_data.items()
        }

    def felt(self, name: str) -> Felt:
        """Return what each sensor felt in a recording."""
        return Felt.of(inflated(self.drawn[name]))

    def matrix(self, name: str) -> FloatArray:
        """Return the recording's matrix V, (S, L)."""
        return self._results.matrix(name)

    def fit(self, name: str) -> tuple[Row, Particle] | None:
        """Return the numbers of the recording's fit, and Theta*; None if it has none.

        Without a nodule of known size, a recording has no fit.
        """
        particle = self._particles.get(name)
        return (self._fits[name], particle) if particle else None


def fold_templates(
    templates: TemplateSet,
    particles: Mapping[str, Particle],
    accepted: Mapping[str, Row],
    rules: Settings,
) -> dict[str, dict[str, dict[float, bytes]]]:
    """Return the averaged particles that judged each recording.

    Each is the content of its vector of parameters, so that equal ones are found again.

    Parameters
    ----------
    templates : TemplateSet
        The templates of all recordings that teach.
    particles : mapping of str to Particle
        The optimal particle of each recording that teaches, by recording.
    accepted : mapping of str to mapping
        Rows of results/recordings.csv by recording.
    rules : mapping
        Section ``evaluation`` of the configuration.

    Returns
    -------
    dict
        By recording, scheme and size in mm; a size that all recordings left out has none.
    """
    labelled = {name: row for name, row in accepted.items() if row["size_mm"]}
    unlabelled = [name for name in accepted if name not in labelled]
    # Scheme, judged recordings, and the labelled recordings that do not teach.
    every = [(fold.scheme, fold.judged, fold.left_out) for fold in folds_of(labelled, rules)]
    every += [(ALL, tuple(some), out) for out, some in unlabelled_folds(unlabelled, accepted)]
    sizes_mm = sizes_of(particles)
    found: dict[str, dict[str, dict[float, bytes]]] = {name: {} for name in accepted}
    for scheme, judged, left_out in every:
        # In the order of the archive, because rounding makes a sum depend on the order.
        apart = [name for name in accepted if name in left_out and name in particles]
        remaining = templates.totals_without((sizes_mm[name], particles[name]) for name in apart)
        averaged = {
            size: total.mean().to_vector().tobytes()
            for size, total in zip(templates.sizes_mm, remaining, strict=True)
            if total.count
        }
        # The recordings that a fold judges share its templates.
        for name in judged:
            found[name][scheme] = averaged
    return found


def archive_evidence(
    rows: Sequence[Row],
    verdicts: Mapping[str, Sequence[Row]],
    largest_mm: float,
    stored: StoredRecordings,
    settings: Settings,
    spread: Spread = map,
) -> Iterator[tuple[str, str]]:
    """Yield what the page shows of each recording, one at a time.

    Parameters
    ----------
    rows : sequence of mapping
        Accepted ones from `capsule.page.recordings.recording_rows`.
    verdicts : mapping of str to sequence of mapping
        From `verdicts_by_recording`.
    largest_mm : float
        The largest size that the archive holds.
    stored : StoredRecordings
        The stored results.
    settings : mapping
        The configuration.
    spread : callable
        Calls a function with each part of the work, like `map`.

    Yields
    ------
    recording : str
        The recording.
    evidence : str
        JSON from `evidence_among_others`, with ``drawn`` from `capsule.page.plot_data`.
    """
    first_peak, length = settings["fit"]["first_peak"], settings["preprocessing"]["length"]

    @lru_cache(maxsize=_TEMPLATES_KEPT)
    def rendered(vector: bytes) -> RepeatedParticle:
        return RepeatedParticle(render(particle_of(vector), first_peak, length))

    def shown(row: Row) -> tuple[str, str]:
        name = row["recording"]
        said = [in_words(each, largest_mm) for each in verdicts.get(name, [])]
        # The schemes share most templates.
        gain_of = cache(SlidingComparison(stored.matrix(name)).gain_of)
        nearest = {}
        for scheme, averaged in stored.templates[name].items():
            if averaged:
                templates = {size_mm: rendered(vector) for size_mm, vector in averaged.items()}
                size_mm, lag = nearest_template(gain_of, templates)
                nearest[scheme] = NearestTemplate(size_mm, particle_of(averaged[size_mm]), lag)
        content = evidence_among_others(row, said, nearest, stored.fit(name), settings)
        return name, to_json({"drawn": stored.drawn[name], **content})

    def in_turn(some: Sequence[Row]) -> list[tuple[str, str]]:
        return [shown(row) for row in some]

    parts = [rows[start : start + _IN_TURN] for start in range(0, len(rows), _IN_TURN)]
    for part in spread(in_turn, parts):
        yield from part


def particle_of(vector: bytes) -> Particle:
    """Return the particle that is stored in `fold_templates`."""
    return Particle.from_vector(np.frombuffer(vector))


def evidence_among_others(
    row: Row,
    verdicts: Sequence[Row],
    nearest: Mapping[str, NearestTemplate],
    fit: tuple[Row, Particle] | None,
    settings: Settings,
) -> Cells:
    """Return what the page shows of one recording because of its fit and the other recordings.

    Parameters
    ----------
    row : mapping
        From `capsule.page.recordings.recording_rows`.
    verdicts : sequence of mapping
        Each detector's verdict, from `in_words`.
    nearest : mapping of str to NearestTemplate
        The nearest template under each scheme.
    fit : (mapping, Particle) or None
        From `StoredRecordings.fit`.
    settings : mapping
        The configuration.

    Returns
    -------
    dict
        Ready for `to_json`: ``title``, ``row``, ``nodule_at_mm``, ``fitted`` (from `surface`),
        ``fit`` (in words), ``templates`` (from `surface`) and ``verdicts``. ``fitted`` and ``fit``
        are None without a fit.
    """
    first_peak, length = settings["fit"]["first_peak"], settings["preprocessing"]["length"]
    fitted = said = None
    if fit:
        numbers, particle = fit
        fitted = surface(particle, numbers["first_peak"], numbers["lag"], length)
        said = (
            f"RMSE {words.number(numbers['rmse'], 4)}; the best of the random particles had "
            f"{words.number(numbers['rmse_initial'], 4)}, and "
            f"{words.plural(numbers['accepted_moves'], 'step')} improved it; lag {numbers['lag']}"
        )
    return {
        "title": {None: "unlabelled", 0.0: "no nodule"}.get(
            row["size_mm"], f"{row['size']} nodule"
        ),
        "row": row["place"],
        "nodule_at_mm": row["nodule_at_mm"],
        "fitted": fitted,
        "fit": said,
        "templates": {
            scheme: {
                "size_mm": each.size_mm,
                **surface(each.particle, first_peak, each.lag, length),
            }
            for scheme, each in nearest.items()
        },
        "verdicts": verdicts,
    }


def verdicts_by_recording(
    predictions: pd.DataFrame, detections: pd.DataFrame
) -> dict[str, list[Cells]]:
    """Return every verdict on every recording, in the order of the tables.

    Returns
    -------
    dict of str to list of dict
        The rows of the tables; an unknown number is NaN. Unlabelled recordings have the scheme
        `ALL`.
    """
    verdicts: dict[str, list[Cells]] = {}
    for table in (predictions, detections.assign(scheme=ALL)):
        for row in table.to_dict("records"):
            verdicts.setdefault(row["recording"], []).append(row)
    return verdicts


def in_words(verdict: Row, largest_mm: float | None = None) -> Cells:
    """Return what the page shows of a verdict from `verdicts_by_recording`.

    Parameters
    ----------
    verdict : mapping
        The verdict.
    largest_mm : float, optional
        The largest size that the archive holds.

    Returns
    -------
    dict
        ``detector``, ``scheme``, ``predicted_mm``, ``details`` (size, probability and place in
        words), ``distances`` to every template, and `EVIDENCE`. A value that is not known is None.
        A detector that does not use distances has none.
    """
    by_distance = detector_row(verdict["detector"]).fixed_threshold is not None
    labels = [name for name in verdict if name.startswith("rmse_")] if by_distance else []
    return {
        "detector": verdict["detector"],
        "scheme": verdict["scheme"],
        "predicted_mm": known_or_none(verdict["predicted_mm"]),
        "details": _details(verdict, largest_mm),
        "distances": [known_or_none(verdict[name]) for name in labels],
        **{key: seven_digits(verdict.get(key)) for key in EVIDENCE},
    }


def _details(row: Row, largest_mm: float | None) -> str:
    """Return the size, probability and place of a verdict in words; or why there is none."""
    if not words.is_known(row["predicted_mm"]):
        reason = row.get("no_verdict")
        return str(reason) if words.is_known(reason) else ""
    unlike = words.unlike(row)
    parts, location_s = [unlike] if unlike else [], row.get("location_s")
    if words.is_known(row.get("estimate_mm")):
        parts.append(f"estimated {words.estimated_size(row, largest_mm)}")
    probability = words.stated_probability(row)
    if words.is_known(probability):
        parts.append(f"probability {words.probability(probability)}")
    if words.is_known(location_s):
        parts.append(f"place {words.place(location_s, row.get('location_mm'))}")
    return "; ".join(parts) if unlike else ", ".join(parts)


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


def nearest_template(
    gain_of: Callable[[RepeatedParticle], tuple[float, int]],
    templates: Mapping[float, RepeatedParticle],
) -> tuple[float, int]:
    """Return size in mm and lag tau of the template with the largest gain, of equal ones the first.

    Parameters
    ----------
    gain_of : callable
        `SlidingComparison.gain_of` of the comparison with the recording's matrix V, (S, L).
    templates : mapping of float to RepeatedParticle
        The templates of a fold by size in mm, one at least, each (S, L).
    """
    found = {size_mm: gain_of(template) for size_mm, template in templates.items()}
    size_mm = max(found, key=lambda size_mm: found[size_mm][0])
    return size_mm, found[size_mm][1]
