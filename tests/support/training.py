"""Archives that teach detectors, put together from what a test needs."""

import numpy as np

from capsule.detectors.training import TrainingArchive
from capsule.templates import TemplateSet, no_nodule_template

NO_TEMPLATES = TemplateSet((0.0,), (), (no_nodule_template(4, 1000),), 150)


def archive_of_passages(passages, sizes_mm, *, specificity, prevalence, size_ridge):
    """Put together an archive of which only the passages count."""
    settings = {
        "evaluation": {"specificity": specificity, "prevalence": prevalence},
        "diagonal": {"size_ridge": size_ridge},
    }
    return TrainingArchive(sizes_mm, NO_TEMPLATES, {}, passages, {}.__getitem__, settings)


def archive_of_matrices(matrices, sizes_mm, templates, particles, specificity):
    """Put together an archive of which only the matrices count."""
    settings = {"evaluation": {"specificity": specificity}}
    return TrainingArchive(sizes_mm, templates, particles, {}, matrices.__getitem__, settings)


def verdict_values(verdict):
    """List what a verdict says, to compare it with another one's."""
    return [np.nan if value is None else value for value in vars(verdict).values()]
