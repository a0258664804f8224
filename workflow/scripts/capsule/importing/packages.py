"""Call the packages that read binary formats: what they raise, and how much they may read."""

import contextlib
import importlib
import logging
import struct
import tokenize
import warnings
import zipfile
import zlib
from collections.abc import Iterator
from types import ModuleType

from capsule.errors import CapsuleError
from capsule.project import how_to_install

# 500 MB is far more than one run needs. It is less than a day of 64 channels at 100 Hz in single
# precision.
MOST_BYTES = 500_000_000
# A small file that unpacks to more is no recording.
MOST_UNPACKED = 100_000_000
# Damaged bytes can make the readers of binary formats raise any of these.
_DAMAGE: tuple[type[Exception], ...] = (
    ArithmeticError,
    AssertionError,
    AttributeError,
    EOFError,
    LookupError,
    MemoryError,
    NameError,
    NotImplementedError,
    OSError,
    RuntimeError,
    SyntaxError,
    SystemError,
    TypeError,
    ValueError,
    struct.error,
    tokenize.TokenError,
    zipfile.BadZipFile,
    zlib.error,
)
_LONGEST_REASON = 100


def too_large(most_bytes: int = MOST_BYTES) -> str:
    """Return the reason against a file, or its content, that is larger than this."""
    return (
        f"it is larger than {most_bytes / 1e6:g} MB, too large for one session; split it into "
        "smaller files"
    )


def refuse_unpacked(size: int) -> None:
    """Raise an error if a small file unpacks to more bytes than one session needs."""
    if size > MOST_UNPACKED:
        raise CapsuleError(f"unpacked, {too_large(MOST_UNPACKED)}")


@contextlib.contextmanager
def damage_named(format_name: str, remedy: str, *own: type[Exception]) -> Iterator[None]:
    """Turn the exceptions of a package on a damaged file into an error of one line.

    Parameters
    ----------
    format_name : str
        Name of the format in words.
    remedy : str
        Advice for the user.
    *own : exception types
        Exceptions that the package defines.

    Raises
    ------
    CapsuleError
        The package cannot read the file.
    """
    level = logging.root.manager.disable
    # Some packages log their repairs, with the damaged bytes.
    logging.disable(logging.CRITICAL)
    try:
        with warnings.catch_warnings():
            # They also warn about charts, checks and other versions of their format.
            warnings.simplefilter("ignore", UserWarning)
            yield
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
        Name of the module.
    format_name : str
        Name of the format in words.

    Raises
    ------
    CapsuleError
        The package is not installed; the message says how to install it.
    """
    try:
        return importlib.import_module(module)
    except ModuleNotFoundError as error:
        if error.name and not module.startswith(error.name):
            raise
        raise CapsuleError(
            f"{format_name} is read by the package {module.partition('.')[0]}, which is not "
            f"installed; run {how_to_install('formats')}"
        ) from None
