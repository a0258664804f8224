"""The packages of the extra ``import``: imported when a file needs one."""

import contextlib
import importlib
import logging
import struct
import zipfile
import zlib
from collections.abc import Iterator
from types import ModuleType

from capsule.errors import CapsuleError

# What the readers of binary formats raise is whatever the damaged bytes lead them to.
_DAMAGE = (
    ArithmeticError,
    AssertionError,
    AttributeError,
    EOFError,
    LookupError,
    MemoryError,
    NotImplementedError,
    OSError,
    RuntimeError,
    SyntaxError,
    TypeError,
    ValueError,
    struct.error,
    zipfile.BadZipFile,
    zlib.error,
)
_LONGEST_REASON = 100


@contextlib.contextmanager
def damage_named(format_name: str, remedy: str, *own: type[Exception]) -> Iterator[None]:
    """Turn what a package raises on a damaged file into one line.

    Parameters
    ----------
    format_name : str
        What the package reads, in words.
    remedy : str
        What the user can do.
    *own : exception types
        Those of the package itself.

    Raises
    ------
    CapsuleError
        In place of any of these.
    """
    level = logging.root.manager.disable
    # Some log what they repair, with the damaged bytes.
    logging.disable(logging.CRITICAL)
    try:
        yield
    except CapsuleError:
        raise
    except (*_DAMAGE, *own) as fault:
        reason = " ".join(str(fault).split())[:_LONGEST_REASON] or type(fault).__name__
        raise CapsuleError(f"the {format_name} cannot be read ({reason}); {remedy}") from None
    finally:
        logging.disable(level)


def needed_package(module: str, format_name: str) -> ModuleType:
    """Import a package that reads a format.

    Parameters
    ----------
    module : str
        What is imported.
    format_name : str
        What it reads, in words.

    Raises
    ------
    CapsuleError
        It is not installed; the text says how it is.
    """
    try:
        return importlib.import_module(module)
    except ModuleNotFoundError as error:
        if error.name and not module.startswith(error.name):
            raise
        raise CapsuleError(
            f"{format_name} is read by the package {module.partition('.')[0]}, which is not "
            'installed; run: pip install "origami-capsule[import]"'
        ) from None
