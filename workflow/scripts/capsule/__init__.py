"""The library, and the public names of `import capsule`.

A module is imported only when a program uses one of its names: each step of the workflow imports
this file. Snakemake follows import statements, so a module that a text names starts no new run.
"""

from importlib import import_module

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
    "capsule.method.templates": (
        *("TemplateSet", "build_templates"),
        *("nearest_size", "template_distances"),
    ),
    "capsule.interface.archive": ("LoadedArchive", "load", "read_recording"),
    "capsule.interface.evaluate": ("Judgement", "folds", "judge"),
    "capsule.interface.estimators": ("DetectorEstimator", "MatrixTransformer"),
}
_MODULE_OF = {name: module for module, names in _MODULES.items() for name in names}


def __dir__() -> list[str]:
    """List the public names, sorted."""
    return sorted(_MODULE_OF)


def __getattr__(name: str) -> object:
    """Import the object behind a public name; raise AttributeError if there is no such name."""
    if name == "__all__":
        return __dir__()
    if name == "__version__":
        return import_module("capsule.engine.project").project_version()
    if name not in _MODULE_OF:
        raise AttributeError(f"module 'capsule' has no attribute {name!r}")
    found = getattr(import_module(_MODULE_OF[name]), name)
    if not isinstance(found, type) and not _MODULE_OF[name].startswith("capsule.interface"):
        # A function of the method itself, which the workflow calls without these checks.
        found = import_module("capsule.interface.arguments").checked(found)
    globals()[name] = found
    return found
