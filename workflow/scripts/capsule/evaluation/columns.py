"""Names of the tables that rate the detectors, and the columns of each table without rows.

This module imports nothing heavy, because the Snakefile reads the names.
"""

from collections.abc import Iterable

# The head of the columns of verdicts with the distances to the templates.
DISTANCE = "rmse_"

# One row for each detector and site with several passes.
SITES = [
    *("site", "size_mm", "recordings", "detector", "passes", "score", "threshold", "detected"),
    *("estimate_mm", "location_mm", "estimate_low_mm", "estimate_high_mm"),
    *("familiar", "unlike_recording", "unfamiliar_because", "unlike_value", "unlike_least"),
    *("unlike_most", "verdict"),
]

_KEY = ("detector", "scheme")
# Rates by the paper's definitions. In the tables, an empty size stands for any nodule.
RATES = {
    "detection": [
        *(*_KEY, "size_mm", "tp", "fp", "fn"),
        *("precision", "precision_low", "precision_high", "precision_at_least"),
        *("recall", "recall_low", "recall_high", "recall_at_least", "clusters"),
    ],
    "sizing": [
        *(*_KEY, "size_mm", "recordings", "exact", "exact_rate", "exact_rate_low"),
        *("exact_rate_high", "within", "within_rate", "within_rate_low", "within_rate_high"),
        *("one_sided", "mean_absolute_error_mm", "mean_absolute_error_mm_low"),
        *("mean_absolute_error_mm_high", "detected", "detected_clusters"),
        *("bias_mm", "bias_mm_low", "bias_mm_high"),
        *("absolute_error_mm", "absolute_error_mm_low", "absolute_error_mm_high"),
        *("located", "located_clusters"),
        *("location_error_mm", "location_error_mm_low", "location_error_mm_high"),
        *("location_bias_mm", "location_bias_mm_low", "location_bias_mm_high", "clusters"),
    ],
    "confusion": [
        *(*_KEY, "size_mm", "predicted_mm", "count", "share", "share_low", "share_high"),
    ],
}
COLUMNS = {
    **RATES,
    "summary": [
        *(*_KEY, "size_mm", "recordings", "accuracy", "sensitivity", "specificity"),
        *("sensitivity_at_specificity", "auc", "prevalence", "ppv", "npv"),
    ],
    "calibration": [*_KEY, "stated_low", "stated_high", "recordings", "stated", "brier"],
    "comparison": ["scheme", "first", "second", "measure", "size_mm", "recordings"],
    "retest": [*_KEY, "passes", "size_mm", "sites", "detected"],
    "roc": [*_KEY, "size_mm", "false_positive_rate", "true_positive_rate"],
}


def distance_columns(columns: Iterable[str]) -> dict[str, float]:
    """Return the columns of distances to the templates, with the size in mm of each template."""
    named = (column for column in columns if column.startswith(DISTANCE))
    return {name: float(name.removeprefix(DISTANCE).removesuffix("mm")) for name in named}
