"""Make archives that teach detectors, with only the parts that a test needs."""

import numpy as np

from capsule.detectors.network import Features
from capsule.detectors.training import TrainingArchive
from capsule.templates import TemplateSet, no_nodule_template

TAUGHT = {
    "height": 10.0,
    "penalty": 0.1,
    "evidence_weight": 2.0,
    "size_ridge": 1.0,
}
NO_FEATURES = Features(np.nan, np.full(64, np.nan, np.float32), np.full(1024, np.nan, np.float32))
NO_TEMPLATES = TemplateSet((0.0,), (), (no_nodule_template(4, 1000),), 150)


def archive_of_passages(passages, sizes_mm, *, specificity, prevalence, size_ridge):
    """Return an archive with passages only; its recordings have no score."""
    rules = {"specificity": specificity, "prevalence": prevalence, "size_confidence": 0.9}
    settings = {
        "evaluation": rules,
        "diagonal": {"size_ridge": size_ridge},
        "taught": TAUGHT,
    }
    features = dict.fromkeys(passages, NO_FEATURES)
    return TrainingArchive(sizes_mm, NO_TEMPLATES, {}, passages, {}.__getitem__, settings, features)


def archive_of_matrices(matrices, sizes_mm, templates, particles, specificity):
    """Return an archive with matrices only."""
    settings = {"evaluation": {"specificity": specificity}}
    return TrainingArchive(sizes_mm, templates, particles, {}, matrices.__getitem__, settings)


def verdict_values(verdict):
    """Return the values of a verdict as a list, to compare it with another verdict."""
    return [np.nan if value is None else value for value in vars(verdict).values()]
