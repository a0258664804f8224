"""The interface for programs and notebooks: archives, judgements and estimators."""
