"""Say in words that a recording is unlike those that teach, and why, or why that is not known."""

from capsule import words
from capsule.detectors.familiar import NO_WAVE, TOO_FEW
from capsule.detectors.verdicts import VerdictWord
from capsule.kinds import Row

# Each trait of `capsule.detectors.wave_traits` in words, and the unit in which it is told.
_TRAITS = {
    "period_s": ("the time from wave to wave is {}", "s"),
    "step_s": ("the wave takes {} from sensor to sensor", "s"),
    "step_spread_s": ("the wave's times from sensor to sensor differ by {}", "s"),
    "unsteadiness": ("the time from wave to wave varies by {} of it", "%"),
    "wave_share": ("the wave makes {} of what a sensor feels", "%"),
    "noise": ("from sample to sample a reading bends by {} of a wave's depth", "%"),
}


def unlike(row: Row) -> str:
    """Return that a recording is unlike those that teach, and why; empty if it is not.

    Parameters
    ----------
    row : mapping
        The columns of `capsule.detectors.familiar.Familiarity`, as in results/detections.csv; in
        results/sites.csv, ``unlike_recording`` names the pass that they are of.
    """
    because = unlike_because(row)
    return f"{VerdictWord.UNLIKE}: {because}" if because else ""


def unlike_because(row: Row) -> str:
    """Return why a recording is unlike those that teach; empty if it is not."""
    return because(row) if row.get("familiar") == "no" else ""


def because(row: Row) -> str:
    """Return why a recording is unlike those that teach, or why nobody can tell."""
    first, *others = str(row["unfamiliar_because"] or "").split() or [""]
    if first == TOO_FEW:
        taught = words.plural(int(row["unlike_value"]), "place teaches", "places teach")
        return f"only {taught} what is familiar; {row['unlike_least']:g} are needed"
    if first == NO_WAVE:
        return "the recording shows no wave to compare"
    if first not in _TRAITS:
        return ""
    sentence, unit = _TRAITS[first]
    value, least, most = (
        words.significant(float(row[f"unlike_{name}"]) * (100.0 if unit == "%" else 1.0))
        for name in ("value", "least", "most")
    )
    said = f"{sentence.format(f'{value} {unit}')}, but {least} to {most} {unit}"
    more = words.plural(len(others), "other trait deviates", "other traits deviate")
    pass_of_site = f"{row['unlike_recording']}: " if "unlike_recording" in row else ""
    return f"{pass_of_site}{said} in the recordings that teach{f'; {more} too' if others else ''}"


def familiarity_line(row: Row) -> str:
    """Return what stands before a verdict: `unlike`, or that nobody can tell; else empty."""
    if row["familiar"] == "":
        return f"whether it is like the recordings that teach is not known: {because(row)}"
    return unlike(row)
