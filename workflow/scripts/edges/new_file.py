"""Write new files; an existing file is never replaced."""

import os
from pathlib import Path

from edges.files import write_whole


def write_new(path: Path, content: bytes) -> None:
    """Write a new file; the name must be free.

    Raises
    ------
    FileExistsError
        A file with this name exists.
    OSError
        The file cannot be written; the error names it.
    """
    beside = path.with_name(f".{path.name}.{os.getpid()}.new")
    with write_whole(beside, "wb") as stream:
        stream.write(content)
    try:
        os.link(beside, path)  # atomic, and fails if the name exists
    except FileExistsError:
        raise
    except OSError:  # a file system without links, as on a USB stick
        with path.open("xb") as stream:
            stream.write(content)
    finally:
        beside.unlink(missing_ok=True)
