"""The interface for programs and notebooks: archives as objects, and detectors as estimators."""
