"""Make one stage of each recording of a set that is not up to date, with a log for each."""

import argparse
import contextlib
import io
import json
import os
import time
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path

from capsule.errors import CapsuleError
from capsule.kinds import Settings
from edges import files
from edges.recording_files import reasons_to_make, recording_files, recording_key
from edges.records import Record, stored_record, unwatched, watching_record
from edges.set_files import write_set_file

# Makes one stage of a recording, from raw/, results/, its name and the settings.
Make = Callable[[Path, Path, str, Settings], None]


def make_set(stage: str, make: Make, description: str | None) -> None:
    """Read the arguments of a set's job, make what is not up to date, and write the set's file.

    Parameters
    ----------
    stage : {"preprocess", "fit"}
        The stage.
    make : callable
        Makes the stage of one recording.
    description : str
        Description of the script.
    """
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("recordings", nargs="+", help="names such as 3mm/r07")
    parser.add_argument("--raw", type=Path, required=True, help="the folder of recordings")
    parser.add_argument("--results", type=Path, required=True, help="the folder of results")
    parser.add_argument("--settings", type=json.loads, required=True, help="config sections, JSON")
    parser.add_argument("--key", required=True, help="checksum of the stage's settings and code")
    parser.add_argument("--output", type=Path, required=True, help="output: the set's file")
    arguments = parser.parse_args()
    raw, results, settings = arguments.raw, arguments.results, arguments.settings
    parts = []
    for name in arguments.recordings:
        with unwatched():
            part = _up_to_date(results, stage, arguments.key, name)
        if part is None:
            with _own_log(results / "logs" / stage / f"{name}.log"):
                told = recording_key(results, stage, arguments.key, name)
                part = files.make_recorded(told, partial(make, raw, results, name, settings))
        parts.append(part)
        if job := watching_record():
            job.add_part(part)
    write_set_file(arguments.output, results, parts)


def _up_to_date(results: Path, stage: str, key: str, name: str) -> Record | None:
    """Return the record of a recording's files; None if they must be made."""
    if reasons_to_make(results, stage, key, [name]):
        return None
    outputs = recording_files(results, stage, name)
    record = stored_record(outputs[0])
    if record:
        _touch_outdated(
            outputs, [path for path in record.read if path.startswith(f"{results.as_posix()}/")]
        )
    return record


def _touch_outdated(outputs: Sequence[Path], inputs: Sequence[str]) -> None:
    """Renew the time stamp of results that are older than the results they were made from.

    An earlier stage can make the same content again. With one recording in a job, Snakemake
    compares the time stamps.
    """
    newest_s = max(map(os.path.getmtime, inputs), default=0.0)
    for path in outputs:
        if path.stat().st_mtime < newest_s:
            path.touch()


@contextlib.contextmanager
def _own_log(path: Path) -> Iterator[None]:
    """Write what is printed meanwhile also into a log of its own, with the duration."""
    text, started = io.StringIO(), time.perf_counter()
    try:
        with contextlib.redirect_stdout(text):
            yield
        print(f"finished in {time.perf_counter() - started:.3f} s", file=text)
    except (CapsuleError, OSError) as error:
        print(files.error_line(error), file=text)
        raise
    finally:
        print(text.getvalue(), end="")
        # The log is no result. On a full disk, the write of a result raises the error.
        with contextlib.suppress(OSError):
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text.getvalue(), encoding="utf-8", errors="backslashreplace")
