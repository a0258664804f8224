"""The evaluation of the detectors: predictions by folds, rates, tables, sites."""
