"""The detectors, and what they share: scores, thresholds, probabilities, sizes and verdicts."""
