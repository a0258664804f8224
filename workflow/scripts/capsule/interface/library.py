"""Read an archive or a recording, for users of the library."""

from pathlib import Path
from typing import BinaryIO

from capsule import files, recording
from capsule.checking import check_recording
from capsule.errors import CapsuleError
from capsule.interface.arguments import checked, refuse
from capsule.interface.loaded_archive import LoadedArchive
from capsule.listing import full_list, refuse_rejected
from capsule.recording import Recording
from capsule.settings import read_settings


def load(
    raw: str | Path = "raw", config: str | Path | None = None, **changes: object
) -> LoadedArchive:
    """Read, check and pre-process all recordings under a folder, as the workflow does.

    Parameters
    ----------
    raw : str or Path
        The folder, with folders such as ``0mm``, ``2.5mm`` and ``unlabelled`` in it.
    config : str or Path, optional
        A configuration file. The default is ``config/config.yaml`` beside the folder; if that file
        does not exist, the configuration that ships with the library.
    **changes
        Other values for keys of the configuration; a dict changes keys of a section, as in
        ``load(fit={"iterations": 500})``.

    Returns
    -------
    LoadedArchive

    Raises
    ------
    CapsuleError
        The folder or the configuration cannot be used. A recording that cannot be used raises no
        error: it is listed with the reason.
    """
    if not isinstance(raw, str | Path):
        raise refuse("raw", raw, "a path to a folder of recordings")
    folder = Path(raw)
    beside = folder.resolve().parent / "config" / "config.yaml"
    chosen = Path(config) if config is not None else beside if beside.exists() else None
    settings = read_settings(chosen, **changes)
    archive = files.list_archive(folder)
    max_bytes = int(settings["recording"]["max_megabytes"] * 1e6)
    checks, readings = {}, {}
    for name in archive.recordings:
        content = files.read_limited(folder / f"{name}.csv", max_bytes)
        checks[name], readings[name], _ = check_recording(name, content, max_bytes, settings)
    rows = full_list(archive, checks, readings.__getitem__)
    if settings["on_rejected"] == "fail":
        refuse_rejected(rows)
    return LoadedArchive(rows, checks, readings, archive.passed_over, settings)


@checked
def read_recording(
    stream: str | Path | BinaryIO, sensors: int, max_bytes: int = 16_000_000
) -> Recording:
    """Read a recording of `sensors` sensors from a path, or from a file that is open for reading.

    Raises
    ------
    CapsuleError
        The file cannot be read, is larger than `max_bytes`, or is no recording.
    """
    if isinstance(stream, str | Path):
        try:
            with Path(stream).open("rb") as opened:
                return recording.read_recording(opened, sensors, max_bytes)
        except OSError as error:
            raise CapsuleError(f"{stream}: it cannot be read: {error.strerror}") from None
    if not hasattr(stream, "read"):
        raise refuse("stream", stream, "a path, or a file that is open for reading")
    return recording.read_recording(stream, sensors, max_bytes)
