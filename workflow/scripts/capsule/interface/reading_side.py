"""Finds the modules that read from disk, which the library itself does without."""

import sys
from importlib import import_module
from importlib.util import find_spec
from types import ModuleType

from capsule.errors import CapsuleError

_PACKAGE = "edges"
# Where an installed library keeps the project: its settings, schemas, weights and scripts.
_INSTALLED = "capsule_project"


def import_reader(module: str) -> ModuleType:
    """Import a module of `edges`.

    Beside a script of the project `edges` is importable already. An installed library finds it in
    the folder ``capsule_project``, which then stands at the end of `sys.path`.

    Parameters
    ----------
    module : str
        Its name within `edges`.

    Raises
    ------
    CapsuleError
        Neither is there.
    """
    if find_spec(_PACKAGE) is None:
        installed = find_spec(_INSTALLED)
        if installed is None or not installed.submodule_search_locations:
            raise CapsuleError(
                f"the folder {_INSTALLED} is missing beside the package capsule, so nothing can be "
                "read from disk; install the project again: pip install ."
            )
        sys.path += [
            f"{folder}/workflow/scripts" for folder in installed.submodule_search_locations
        ]
    return import_module(f"{_PACKAGE}.{module}")
