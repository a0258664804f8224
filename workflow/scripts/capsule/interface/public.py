"""List the public names of `import capsule`, and the module of each.

This module imports nothing heavy: a module is imported when a program uses one of its names.
"""

from functools import cache
from importlib import import_module
from inspect import isclass

_MODULES = {
    "capsule.errors": ("CapsuleError", "RecordingError"),
    "capsule.recording": ("Recording", "format_recording"),
    "capsule.preprocessing": ("normalize", "preprocess", "rectify", "rms_envelope"),
    "capsule.particles": ("ParameterSpace", "Particle", "render"),
    "capsule.fitting": ("Fit", "fit_particle", "fit_recording"),
    "capsule.seeding": ("fit_generator",),
    "capsule.settings": ("read_settings",),
    "capsule.templates": ("TemplateSet", "build_templates"),
    "capsule.detectors.template": ("nearest_size", "template_distances"),
    "capsule.interface.loaded_archive": ("LoadedArchive",),
    "capsule.interface.splits": ("folds",),
    "capsule.interface.judging": ("Judgement", "judge"),
    "capsule.interface.library": ("load", "read_recording"),
    "capsule.interface.estimators": (
        "DetectorEstimator",
        "DiagonalEstimator",
        "MatrixTransformer",
        "TaughtEstimator",
        "TemplateEstimator",
        "TemplateThresholdEstimator",
    ),
}
_MODULE_OF = {name: module for module, names in _MODULES.items() for name in names}


def public_names() -> list[str]:
    """Return all public names of `import capsule`, sorted."""
    return sorted(_MODULE_OF)


def attribute(name: str) -> object:
    """Import the object behind a public name; raise AttributeError if there is no such name."""
    if name == "__all__":
        return public_names()
    if name not in _MODULE_OF:
        raise AttributeError(f"module 'capsule' has no attribute {name!r}")
    return _imported(name)


@cache
def _imported(name: str) -> object:
    module = import_module(_MODULE_OF[name])
    found = getattr(module, name)
    if isclass(found) or module.__package__ == __package__:
        return found
    # The functions of the method itself, which the workflow calls without these checks.
    return import_module("capsule.interface.arguments").checked(found)
