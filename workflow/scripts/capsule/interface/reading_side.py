"""Import the modules that read from disk, which are outside the library."""

import sys
from importlib import import_module
from importlib.util import find_spec
from types import ModuleType

from capsule.errors import CapsuleError

_PACKAGE = "edges"
# Folder of an installed library with the project's settings, schemas, weights and scripts.
_INSTALLED = "capsule_project"


def import_reader(module: str) -> ModuleType:
    """Import a module of `edges`, and return it.

    A script of the project can import `edges` directly. An installed library finds it in the
    folder ``capsule_project``, which this function adds to the end of `sys.path`.

    Parameters
    ----------
    module : str
        The module's name within `edges`.

    Raises
    ------
    CapsuleError
        If `edges` cannot be found.
    """
    if find_spec(_PACKAGE) is None:
        installed = find_spec(_INSTALLED)
        if installed is None or not installed.submodule_search_locations:
            raise CapsuleError(
                f"the folder {_INSTALLED} is missing beside the package capsule, so the library "
                "cannot read from disk; install the project again: pip install ."
            )
        sys.path += [
            f"{folder}/workflow/scripts" for folder in installed.submodule_search_locations
        ]
    return import_module(f"{_PACKAGE}.{module}")
