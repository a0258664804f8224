"""Write the files of an export, and show the progress in one line."""

import importlib
import io
import sys
from pathlib import Path

from capsule import files
from capsule.errors import CapsuleError
from capsule.exporting.exported import Exported
from capsule.project import how_to_install


def tell(done: int, of: int, what: str) -> None:
    """Print the progress in one line, if standard error is a terminal."""
    if sys.stderr.isatty():
        end = "\n" if done == of else ""
        print(f"\r{what} {done} of {of}", end=end, file=sys.stderr, flush=True)


def write(exported: Exported, kind: str, out: Path, *, force: bool) -> tuple[int, int]:
    """Write the files of a format.

    Parameters
    ----------
    exported : Exported
        The data.
    kind : str
        The format.
    out : Path
        The output folder.
    force : bool
        Whether existing files are overwritten.

    Returns
    -------
    tuple of int
        Number of files, and their total size in bytes.

    Raises
    ------
    CapsuleError
        A file exists, or a package is missing; nothing was written.
    """
    module = importlib.import_module(f"capsule.exporting.{kind}_export")
    contents = module.contents(exported)
    existing = [out / name for name in contents if (out / name).exists()]
    if existing and not force:
        more = f" (as do {len(existing) - 1} more)" if len(existing) > 1 else ""
        raise CapsuleError(
            f"{existing[0]} exists{more}; nothing was written. Choose another --out, or overwrite "
            "with --force"
        )
    written = 0
    for done, (name, fill) in enumerate(contents.items(), start=1):
        with files.write_whole(out / name, "wb") as stream:
            try:
                fill(stream)
            except ModuleNotFoundError as error:
                raise CapsuleError(
                    f"--format {kind} needs {error.name}, which is not installed; run "
                    f"{how_to_install('formats')}"
                ) from None
            written += stream.seek(0, io.SEEK_END)
        tell(done, len(contents), "written:")
    return len(contents), written
