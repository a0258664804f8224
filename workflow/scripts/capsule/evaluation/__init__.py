"""How good a detector is: predictions by folds, rates, tables, sites."""
