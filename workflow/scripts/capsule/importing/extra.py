"""Import the packages of the extra ``formats``, each only when a file needs it."""

import contextlib
import importlib
import io
import logging
import struct
import tokenize
import zipfile
import zlib
from collections.abc import Iterator
from types import ModuleType

from capsule.errors import CapsuleError
from capsule.project import how_to_install

# Damaged bytes can make the readers of binary formats raise any of these.
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
    SystemError,
    TypeError,
    ValueError,
    struct.error,
    tokenize.TokenError,
    zipfile.BadZipFile,
    zlib.error,
)
_LONGEST_REASON = 100
# 500 MB is far more than one run needs. It is less than a day of 64 channels at 100 Hz in single
# precision.
LARGEST_UNPACKED = 500_000_000


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
    damage: tuple[type[Exception], ...] = (*_DAMAGE, *own)
    level = logging.root.manager.disable
    # Some packages log their repairs, with the damaged bytes.
    logging.disable(logging.CRITICAL)
    try:
        yield
    except CapsuleError:
        raise
    except damage as fault:
        reason = " ".join(str(fault).split())[:_LONGEST_REASON] or type(fault).__name__
        raise CapsuleError(f"the {format_name} cannot be read ({reason}); {remedy}") from None
    finally:
        logging.disable(level)


def refuse_large_zip(content: bytes) -> None:
    """Raise an error if a zip file unpacks to more bytes than one session needs.

    Raises
    ------
    CapsuleError
        It is too large.
    """
    with zipfile.ZipFile(io.BytesIO(content)) as file:
        size = sum(part.file_size for part in file.infolist())
    if size > LARGEST_UNPACKED:
        raise CapsuleError(too_large_text(LARGEST_UNPACKED))


def too_large_text(most_bytes: int) -> str:
    """Return the message on a file, or on the content of a file, that is larger than this."""
    return (
        f"it is larger than {most_bytes / 1e6:g} MB, too large for one session; split it into "
        "smaller files"
    )


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
