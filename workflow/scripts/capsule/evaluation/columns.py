"""Names of the tables that rate the detectors, and the columns of each table without rows.

This module imports nothing, because the Snakefile reads the names.
"""

COLUMNS = {
    "summary": ["detector", "scheme", "recordings", "accuracy", "sensitivity", "specificity"],
    "predictive_values": ["detector", "scheme", "size_mm", "prevalence", "ppv", "npv"],
    "size_error": ["detector", "scheme", "size_mm", "recordings", "detected", "bias_mm"],
    "calibration": ["detector", "scheme", "stated_low", "stated_high", "recordings", "stated"],
    "brier": ["detector", "scheme", "recordings", "prevalence", "brier", "brier_uninformed"],
    "localisation": ["detector", "scheme", "size_mm", "recordings", "median_absolute_error_mm"],
    "comparison": ["scheme", "first", "second", "measure", "size_mm", "recordings"],
    "retest": ["detector", "scheme", "passes", "size_mm", "sites", "detected"],
    "auc": ["detector", "scheme", "size_mm", "auc"],
    "roc": ["detector", "scheme", "size_mm", "false_positive_rate", "true_positive_rate"],
}
