"""Collect what the page shows of each recording, small enough for a thousand recordings.

What neither its fit nor another recording changes is made by jobs of its own
(`capsule.page.plot_data`). The report adds the fit, the verdicts and the nearest template.
"""

from collections.abc import Iterator, Sequence

from capsule import words
from capsule.detectors.registry import DETECTORS, detector_row
from capsule.detectors.unlike import unlike
from capsule.evaluation.columns import distance_columns
from capsule.kinds import Cells, Row
from capsule.method.particle import Particle, particles_of, peak_positions, render
from capsule.method.sliding import RepeatedParticle, SlidingComparison
from capsule.page.packing import deflated, rounded, to_json
from capsule.page.recordings import known_or_none, outcome, seven_digits
from capsule.page.tables import Tables

# The columns with the evidence for a verdict.
EVIDENCE = ("score", "threshold", "location_mm")


def archive_evidence(rows: Sequence[Row], tables: Tables) -> Iterator[tuple[str, str]]:
    """Yield the name of each accepted recording, and JSON of what the page shows of it.

    The JSON has `drawn` from `capsule.page.plot_data`, and `judged`, which its fit and the other
    recordings change; both are deflated. What is not known is None.
    """
    settings, fits = tables.settings, tables.fits
    first_peak, length = settings["fit"]["first_peak"], settings["preprocessing"]["length"]
    fitted = particles_of(fits)
    named = particles_of({str(each["size_mm"]): each for each in tables.templates})
    averaged = {float(size_mm): particle for size_mm, particle in named.items()}
    rendered = {
        size_mm: RepeatedParticle(render(particle, first_peak, length))
        for size_mm, particle in averaged.items()
    }
    largest_mm = max((each["size_mm"] for each in tables.templates), default=None)
    tolerance_mm = settings["evaluation"]["tolerance_mm"]

    for row in rows:
        name, true_mm = row["recording"], row["size_mm"]
        verdicts = tables.by_recording.get(name, [])
        judged: Cells = {
            "title": f"{row['size']} nodule" if true_mm else row["size"],
            "nodule_at_mm": row["nodule_at_mm"],
            "fitted": None,
            "fit": None,
            "template": None,
            "verdicts": [in_words(each, true_mm, tolerance_mm, largest_mm) for each in verdicts],
        }
        # Without a nodule of known size, a recording has no fit.
        if name in fitted:
            fit = fits[name]
            judged["fitted"] = surface(fitted[name], fit["first_peak"], fit["lag"], length)
            judged["fit"] = (
                f"RMSE {words.number(fit['rmse'], 4)}; the best of the random particles had "
                f"{words.number(fit['rmse_initial'], 4)}, and "
                f"{words.plural(fit['accepted_moves'], 'step')} improved it; lag {fit['lag']}"
            )
        nearest_mm = nearest_nodule_mm(verdicts)
        if nearest_mm in averaged:
            _, lag = SlidingComparison(tables.matrix(name)).gain_of(rendered[nearest_mm])
            shape = surface(averaged[nearest_mm], first_peak, lag, length)
            judged["template"] = {"size": words.size(nearest_mm), **shape}
        drawn = tables.described[name]["drawn"]
        yield name, to_json({"drawn": drawn, "judged": deflated(to_json(judged))})


def nearest_nodule_mm(verdicts: Sequence[Row]) -> float | None:
    """Return the size in mm of the nodule's template at the shortest distance from a recording.

    None if no detector measures distances to templates, or if none is known.
    """
    known = {
        size_mm: row[name]
        for row in verdicts
        if "template" in detector_row(row["detector"]).drawn
        for name, size_mm in distance_columns(row).items()
        if size_mm > 0 and words.is_known(row[name])
    }
    return min(known, key=lambda size_mm: known[size_mm], default=None)


def in_words(
    verdict: Row, true_mm: float | None, tolerance_mm: float, largest_mm: float | None = None
) -> Cells:
    """Return what the page shows of a verdict; a value that is not known is None.

    A detector that does not use distances has none.
    """
    by_distance = DETECTORS[verdict["detector"]].fixed_threshold is not None
    labels = distance_columns(verdict) if by_distance else ()
    predicted_mm = known_or_none(verdict["predicted_mm"])
    return {
        "detector": verdict["detector"],
        "scheme": words.scheme(verdict["scheme"]),
        "said": "no verdict" if predicted_mm is None else words.size(predicted_mm),
        "outcome": outcome(true_mm, predicted_mm, tolerance_mm),
        "details": _details(verdict, largest_mm),
        "distances": [seven_digits(verdict[name]) for name in labels],
        **{key: seven_digits(verdict.get(key)) for key in EVIDENCE},
    }


def _details(row: Row, largest_mm: float | None) -> str:
    """Return the size, probability and place of a verdict in words; or why there is none."""
    if not words.is_known(row["predicted_mm"]):
        reason = row.get("no_verdict")
        return str(reason) if words.is_known(reason) else ""
    strange = unlike(row)
    parts, location_s = [strange] if strange else [], row.get("location_s")
    if words.is_known(row.get("estimate_mm")):
        parts.append(f"estimated {words.estimated_size(row, largest_mm)}")
    probability = words.stated_probability(row)
    if words.is_known(probability):
        parts.append(f"probability {words.probability(probability)}")
    if words.is_known(location_s):
        parts.append(f"place {words.place(location_s, row.get('location_mm'))}")
    return "; ".join(parts) if strange else ", ".join(parts)


def surface(particle: Particle, first_peak: float, lag: int, length: int) -> Cells:
    """Return the values from which the page draws a particle over a recording (eq. G, eq. RMSE).

    The lag is tau in 1..2L; at L + 1 the particle is not shifted. Peaks and ends are in samples
    from the first reading.
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
