"""All tables that rate the detectors, made from their predictions."""

from collections.abc import Mapping, Sequence

from capsule.evaluation import tables
from capsule.evaluation.columns import COLUMNS
from capsule.evaluation.folds import group_scheme
from capsule.kinds import Cells, Settings, Spread


def all_tables(
    predictions: Sequence[Mapping[str, str]],
    sites: Mapping[str, str],
    nodule_at_mm: Mapping[str, float],
    rules: Settings,
    spread: Spread = map,
) -> dict[str, list[Cells]]:
    """Return all tables named in `COLUMNS`.

    Parameters
    ----------
    predictions : sequence of mapping of str to str
        One row for each detector, recording and scheme, as in results/evaluation/predictions.csv.
    sites : mapping of str to str
        The site in each recording's header; empty if it names none.
    nodule_at_mm : mapping of str to float
        Position of the nodule along the way, from each recording's header; NaN if it names none.
    rules : mapping
        Section ``evaluation`` of the configuration.
    spread : callable
        Calls a function with the verdicts of each detector and scheme, like `map`.

    Returns
    -------
    dict of str to list of dict
    """

    def assessed(verdicts: tables.Verdicts) -> dict[str, list[Cells]]:
        return _of_detector(verdicts, sites, nodule_at_mm, rules)

    level, tolerance_mm = rules["confidence"], rules["tolerance_mm"]
    made: dict[str, list[Cells]] = {name: [] for name in COLUMNS}
    by_scheme: dict[str, list[tables.Verdicts]] = {}
    collected = tables.collect(predictions)
    for verdicts, each in zip(collected, spread(assessed, collected), strict=True):
        by_scheme.setdefault(verdicts.key["scheme"], []).append(verdicts)
        for name, rows in each.items():
            made[name] += rows
    for of_scheme in by_scheme.values():
        made["comparison"] += tables.comparisons(of_scheme, tolerance_mm, level)
        made["summary"] += tables.summary(of_scheme, tolerance_mm, level)
    return made


def _of_detector(
    verdicts: tables.Verdicts,
    sites: Mapping[str, str],
    nodule_at_mm: Mapping[str, float],
    rules: Settings,
) -> dict[str, list[Cells]]:
    """Return the rows of one detector under one scheme, for the tables without comparisons."""
    level, seed, prevalence = rules["confidence"], rules["seed"], rules["prevalence"]
    areas, points = tables.curves(verdicts, seed, rules["bootstrap"], level)
    stated, brier = tables.calibrated(verdicts, prevalence, rules["calibration_bins"], level)
    retest = []
    if rules["passes"] and verdicts.key["scheme"] == group_scheme("site"):
        retest = tables.retests(verdicts, sites, rules["passes"], rules["specificity"], level)
    return {
        "auc": areas,
        "roc": points,
        "predictive_values": tables.predictive(verdicts, prevalence, level),
        "calibration": stated,
        "brier": brier,
        "size_error": tables.size_errors(verdicts, level),
        "localisation": tables.localisation(verdicts, nodule_at_mm, level),
        "permutation": tables.permutation(verdicts, seed, rules["permutations"], level),
        "retest": retest,
    }
