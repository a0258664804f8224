"""Write a methods paragraph for a paper from the configuration and the results."""

from collections.abc import Sequence

import pandas as pd

from capsule import words
from capsule.detectors.registry import detector_row
from capsule.evaluation.cross_validation import HELD_OUT, LEAVE_ONE_OUT, RESUBSTITUTION
from capsule.evaluation.lead import Lead, headline_confidence
from capsule.kinds import Settings
from capsule.page import cards
from capsule.page.detector_sections import Rates, answers_of
from capsule.page.notation import cited
from capsule.page.provenance import ProjectState, is_simulated

# Each program's entry in references.bib.
REFERENCES = {
    "Python": "python",
    "snakemake": "moelder2021snakemake",
    "numpy": "harris2020numpy",
    "scipy": "virtanen2020scipy",
    "pandas": "mckinney2010pandas",
    "matplotlib": "hunter2007matplotlib",
    "jinja2": "jinja",
    "uPlot": "uplot",
}
_SCHEMES = {
    HELD_OUT: "on held-out sessions, which taught no detector and chose nothing",
    LEAVE_ONE_OUT: (
        "by leave-one-out: the recordings that taught a detector excluded the place under test"
    ),
    RESUBSTITUTION: "by resubstitution: the recording under test also taught the detector",
}


def methods_sentences(rates: Rates, lead: Lead, equations: Sequence[str]) -> list[str]:
    """Return the methods, one paragraph part per step, with keys of references in brackets.

    Parameters
    ----------
    rates : Rates
        The rates.
    lead : Lead
        The leading detector.
    equations : sequence of str
        ``equations`` of ``paper.yaml``.
    """
    settings = rates.settings
    return [
        _recorded(rates.index, settings["recording"]),
        _processed(settings["preprocessing"], settings["recording"]["sensors"], equations),
        _fitted(settings["fit"], equations),
        _judged(rates),
        _led(rates, lead),
        _bounded(rates.evaluation.predictions, settings["evaluation"]),
    ]


def software_sentence(state: ProjectState, versions: Sequence[tuple[str, str]]) -> str:
    """Return a sentence that names the programs, each with its version and its reference."""
    programs = [f"{name} {version} [{REFERENCES[name]}]" for name, version in versions]
    return f"The results were made by {state.text()}, with {words.enumerate_words(programs)}."


def _recorded(index: pd.DataFrame, rules: Settings) -> str:
    labelled = index[(index["status"] == "accepted") & index["size_mm"].notna()]
    counts = [
        f"{count} without a nodule" if size_mm == 0 else f"{count} of {words.size(float(size_mm))}"
        for size_mm, count in labelled.groupby("size_mm").size().items()
    ]
    of_each = f" ({words.enumerate_words(counts)})" if counts else ""
    simulated = sum(map(is_simulated, labelled["source"].fillna("")))
    origin = ""
    if simulated:
        every = simulated == len(labelled)
        origin = " All were simulated." if every else f" {simulated} of these were simulated."
    rejected = int((index["status"] != "accepted").sum())
    left_out = f" {words.plural(rejected, 'recording')} could not be used." if rejected else ""
    return (
        f"The archive holds N = {len(labelled)} recordings of known nodule size{of_each}, of "
        f"{rules['sensors']} sensors at {rules['rate_hz']:g} Hz.{origin}{left_out}"
    )


def _processed(rules: Settings, sensors: int, equations: Sequence[str]) -> str:
    standardised, envelope, rectified, matrix = (
        cited(f"eq. {label}", equations)
        for label in ("normalization", "RMS_envelope", "ReLU", "extended")
    )
    return (
        f"Pre-processing followed [ge2024capsule]: readings were standardised ({standardised}); "
        f"their RMS envelope over a window of W = {rules['window']} samples was taken "
        f"({envelope}); what exceeded c = {rules['threshold']:g} standard deviations ({rectified}) "
        f"made a matrix of S = {sensors} rows and L = {rules['length']} columns ({matrix})."
    )


def _fitted(rules: Settings, equations: Sequence[str]) -> str:
    particles, update, mean = (
        cited(f"eq. {label}", equations) for label in ("particleSet", "Thetaupdate", "barTheta")
    )
    return (
        f"To every recording of a nodule the best of {rules['particles']} random particles "
        f"({particles}) was fitted and improved in {rules['iterations']} iterations ({update}; "
        f"seed {rules['seed']}). The mean parameters of a size made its template ({mean})."
    )


def _judged(rates: Rates) -> str:
    rules, names = rates.settings["evaluation"], rates.settings["detectors"]
    rows = rates.evaluation.predictions
    rows = rows[rows["scheme"] == rates.schemes[0]]
    described = [
        f"{name} ({detector_row(name).sentence}{_threshold(rows[rows['detector'] == name], name)})"
        for name in names
    ]
    sentence = f"Nodules were detected by {words.enumerate_words(described)}."
    if all(detector_row(name).fixed_threshold is not None for name in names):
        return sentence
    wanted = words.percent(rules["specificity"])
    return f"{sentence} Learned thresholds aim at a specificity of {wanted}."


def _threshold(rows: pd.DataFrame, name: str) -> str:
    """Return a learned threshold with its range over the folds; empty for a fixed threshold."""
    known = rows["threshold"].dropna() if "threshold" in rows else rows.iloc[:0, 0]
    if detector_row(name).fixed_threshold is not None or known.empty:
        return ""
    low, high = (words.significant(float(end)) for end in (known.min(), known.max()))
    return f"; threshold {low}" if low == high else f"; threshold {low} to {high} over the folds"


def _led(rates: Rates, lead: Lead) -> str:
    scheme = rates.schemes[0]
    judged = _SCHEMES.get(scheme, f"by {words.scheme(scheme)}")
    sentence = f"Verdicts were judged {judged}."
    if lead.compared > 1 and not lead.named:
        sentence += (
            f" Of {lead.compared} detectors {lead.detector} had the highest balanced accuracy, "
            f"{words.percent(lead.balanced_accuracy)}"
            f"{' by leave-one-out' if scheme == HELD_OUT else ''}."
        )
    ours = answers_of(rates, lead.detector, scheme, lead)
    found = [
        f"{words.percent(each.recall.value)} ({cards.bounds(each.recall)}) at "
        f"{words.size(each.size_mm)}"
        for each in ours.found
    ]
    usual = rates.settings["evaluation"]["confidence"]
    level, corrected = headline_confidence(lead, scheme, usual), ""
    if level != usual:
        corrected = f", with {words.percent(level)} intervals, which correct for the choice"
    if found:
        listed = words.enumerate_words(found)
        sentence += f" The sensitivity of {lead.detector} was {listed}{corrected}."
    if ours.set_specificity is not None:
        wanted = words.percent(ours.set_specificity.wanted)
        return f"{sentence} Its specificity was set to {wanted} by its threshold, not measured."
    if ours.specificity.of:
        counted = words.count_of(ours.specificity.hits, ours.specificity.of)
        sentence += (
            f" Its specificity was {words.percent(ours.specificity.value)} "
            f"({cards.bounds(ours.specificity)}; {counted})."
        )
    return sentence


def _bounded(predictions: pd.DataFrame, rules: Settings) -> str:
    level, of_size = words.percent(rules["confidence"]), ""
    if "estimate_low_mm" in predictions and predictions["estimate_low_mm"].notna().any():
        of_size = (
            f" Estimated sizes have {words.percent(rules['size_confidence'])} intervals from "
            "cross-validated errors [barber2021jackknife]."
        )
    return (
        f"Intervals are at {level}: Wilson's for rates [wilson1927probable], Koopman's for "
        f"predictive values [koopman1984confidence], stated for a prevalence of "
        f"{words.percent(rules['prevalence'])}, and Student's for means. A size counts as right "
        f"within {rules['tolerance_mm']:g} mm.{of_size}"
    )
