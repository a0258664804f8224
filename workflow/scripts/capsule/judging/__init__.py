"""How far the verdicts can be trusted: curves, probabilities, comparisons, all with intervals."""
