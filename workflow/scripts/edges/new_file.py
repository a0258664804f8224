"""Files that are written under a free name alone."""

import os
from pathlib import Path

from edges.files import write_whole


def write_new(path: Path, content: bytes) -> None:
    """Write a file whole under a name that is free; none is ever replaced.

    Raises
    ------
    FileExistsError
        The name is taken.
    OSError
        Names the file.
    """
    beside = path.with_name(f".{path.name}.{os.getpid()}.new")
    with write_whole(beside, "wb") as stream:
        stream.write(content)
    try:
        os.link(beside, path)  # atomic, and fails where the name exists
    except FileExistsError:
        raise
    except OSError:  # a file system without links, such as a USB stick's
        with path.open("xb") as stream:
            stream.write(content)
    finally:
        beside.unlink(missing_ok=True)
