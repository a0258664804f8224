"""Make recordings that teach detectors, with only the parts that a test needs."""

from functools import partial

import numpy as np

from capsule.detectors.base import StoredRecording
from capsule.detectors.network import EMBEDDED, PROJECTED, Features
from capsule.method.templates import TemplateSet, no_nodule_template

TAUGHT = {"height": 10.0, "penalty": 0.1, "evidence_weight": 2.0, "size_ridge": 1.0}
NO_TEMPLATES = TemplateSet((0.0,), (), (no_nodule_template(4, 1000),), 150)


def features_of(score, embedding, gradient):
    """Return features whose other numbers are 0, so that they teach nothing."""
    wide = np.zeros(EMBEDDED, np.float32), np.zeros(PROJECTED, np.float32)
    wide[0][: len(embedding)], wide[1][: len(gradient)] = embedding, gradient
    return Features(float(score), *wide)


def recordings_of(passages=(), features=(), traits=(), matrices=()):
    """Return what is known of some recordings, each part a dict by name or left out."""
    known = {"passage": passages, "features": features, "traits": traits}
    names = dict.fromkeys(name for part in (*known.values(), matrices) for name in part)
    return {
        name: StoredRecording(
            partial(dict(matrices).__getitem__, name),
            **{key: part[name] for key, part in known.items() if name in part},
        )
        for name in names
    }
