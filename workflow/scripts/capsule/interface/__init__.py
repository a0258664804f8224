"""The interface for programs and notebooks: the public names of `import capsule`.

This module imports nothing heavy: a module is imported when a program uses one of its names.
"""

from functools import cache
from importlib import import_module
from inspect import isclass

from capsule.engine.project import project_version

_MODULES = {
    "capsule.errors": ("CapsuleError", "RecordingError"),
    "capsule.recordings.recording": ("Recording", "format_recording"),
    "capsule.method.preprocessing": ("normalize", "preprocess", "rectify", "rms_envelope"),
    "capsule.method.particle": (
        *("Fit", "ParameterSpace", "Particle"),
        *("fit_particle", "fit_recording", "render"),
    ),
    "capsule.seeding": ("fit_generator",),
    "capsule.engine.configuration": ("read_settings",),
    "capsule.method.templates": ("TemplateSet", "build_templates"),
    "capsule.method.nearest_template": ("nearest_size", "template_distances"),
    "capsule.interface.archive": ("LoadedArchive", "load", "read_recording"),
    "capsule.interface.evaluate": ("Judgement", "folds", "judge"),
    "capsule.interface.estimators": (
        "DetectorEstimator",
        "MatrixTransformer",
    ),
}
_MODULE_OF = {name: module for module, names in _MODULES.items() for name in names}


def public_names() -> list[str]:
    """Return all public names of `import capsule`, sorted."""
    return sorted(_MODULE_OF)


@cache
def attribute(name: str) -> object:
    """Import the object behind a public name; raise AttributeError if there is no such name."""
    if name == "__all__":
        return public_names()
    if name == "__version__":
        return project_version()
    if name not in _MODULE_OF:
        raise AttributeError(f"module 'capsule' has no attribute {name!r}")
    found = getattr(import_module(_MODULE_OF[name]), name)
    if isclass(found) or _MODULE_OF[name].startswith(__name__):
        return found
    # The functions of the method itself, which the workflow calls without these checks.
    return import_module("capsule.interface.arguments").checked(found)
