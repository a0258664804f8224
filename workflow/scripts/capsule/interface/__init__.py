"""What a scientist's own program uses: an archive as an object, and detectors as estimators."""
