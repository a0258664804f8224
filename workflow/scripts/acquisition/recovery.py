"""A recording made of what a killed recorder has left: nothing is cut off, nothing deleted.

Every line that can be read is taken, wherever it stands. A line that cannot is skipped and counted,
and its sample is missing. The file itself is kept beside the recording, under another name.
"""

import bisect
import contextlib
import os
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from acquisition.archive import explain_write_fault, publish
from acquisition.bench_errors import AcquisitionError, NameExistsError
from capsule.naming import PART
from capsule.recording import column_names, format_header
from edges.file_lock import lock_file

KEPT_AS = ".recovered"
_ENTRY = re.compile(r"# ([a-z0-9_]+): ([ -~\u00a0-\U0010ffff]+)")


@dataclass(frozen=True)
class Rescued:
    """What was made of an unfinished recording.

    Attributes
    ----------
    final : Path
        The recording.
    original : Path
        The file it was made of, byte for byte as it was.
    samples : int
        How many lines of samples the recording holds.
    skipped : int
        Lines before the last sample that could not be read.
    dropped : int
        Bytes behind the last sample.
    """

    final: Path
    original: Path
    samples: int
    skipped: int
    dropped: int

    def summary(self) -> str:
        """Say it in one line."""
        parts = [f"recovered {self.final}: {self.samples} samples"]
        if self.skipped:
            parts.append(f"lines skipped because they could not be read: {self.skipped}")
        if self.dropped:
            parts.append(f"{self.dropped} bytes at its end left out: not a whole line")
        return "; ".join([*parts, f"the original is kept as {self.original.name}"])


@dataclass(frozen=True)
class _Line:
    """A line of the file: where it ends, and what it says (None: nothing that can be read)."""

    end: int
    time_s: float | None = None
    text: str | None = None


def recover(part: Path, sensors: int) -> Rescued:
    """Make a recording of what a killed recorder has left.

    Parameters
    ----------
    part : Path
        The ``.part`` file; it is renamed and never written.
    sensors : int
        Number of sensors S.

    Returns
    -------
    Rescued

    Raises
    ------
    AcquisitionError
        It is being recorded at this moment, holds no sample, or is none of ours.
    NameExistsError
        There is a recording of that name, or an original that was kept before.
    """
    if part.suffix != PART:
        raise AcquisitionError(
            f"{part} is not an unfinished recording: the name of one ends in {PART}"
        )
    final = part.with_name(part.name.removesuffix(PART))
    original = part.with_name(part.name + KEPT_AS)
    for taken in (final, original):
        if taken.exists():
            raise NameExistsError(
                f"{taken} exists; rename it or {part.name}, then run --recover again"
            )
    with _opened(part):
        content = part.read_bytes()
        recording, rescued = rescue(content, sensors, final, original)
        _write(recording, final)
    publish(part, original)
    return rescued


def rescue(content: bytes, sensors: int, final: Path, original: Path) -> tuple[bytes, Rescued]:
    """Take from an unfinished recording whatever can be read.

    Parameters
    ----------
    content : bytes
        What is in the file.
    sensors : int
        Number of sensors S.
    final, original : Path
        The names that the recording and the file will have.

    Returns
    -------
    recording : bytes
        The recording. Where lines were skipped, its header says how many.
    rescued : Rescued

    Raises
    ------
    AcquisitionError
        There is no sample in it.
    """
    header, damaged, samples = _read(_split(content), sensors)
    readable = [line for line in samples if line.time_s is not None]
    kept = _longest_run([line.time_s for line in samples if line.time_s is not None])
    if not kept:
        raise AcquisitionError(
            f"{original.with_suffix('')} holds no sample; there is nothing to recover, and the "
            "file is unchanged"
        )
    taken = [readable[index] for index in kept]
    end = taken[-1].end
    skipped = damaged + sum(line.end < end for line in samples) - (len(taken) - 1)
    if skipped:
        header["recovered"] = f"lines skipped because they could not be read: {skipped}"
    text = format_header(header, sensors) + "".join(f"{line.text}\n" for line in taken)
    rescued = Rescued(final, original, len(taken), skipped, len(content) - end)
    return text.encode("utf-8"), rescued


def _split(content: bytes) -> list[tuple[int, bytes]]:
    """Give each whole line without its end (LF, or CR LF), and where the next one begins."""
    lines, end = [], 0
    for line in content.split(b"\n")[:-1]:
        end += len(line) + 1
        lines.append((end, line.removesuffix(b"\r")))
    return lines


def _read(
    lines: Sequence[tuple[int, bytes]], sensors: int
) -> tuple[dict[str, str], int, list[_Line]]:
    """Read the header, count its damaged lines, and read the samples."""
    columns = ",".join(column_names(sensors)).encode()
    header: dict[str, str] = {}
    damaged = 0
    samples: list[_Line] = []
    form = re.compile(rb"(\d{1,9}(?:\.\d{1,6})?)(?:(?:,\d{1,10}){%d}|,{%d})" % (sensors, sensors))
    in_header = True
    for end, line in lines:
        if in_header and not re.fullmatch(rb"[0-9.,]+", line):
            entry = _entry(line)
            header |= entry
            in_header = line != columns
            damaged += in_header and not entry
            continue
        in_header = False
        match = form.fullmatch(line)
        samples.append(_Line(end, float(match[1]), line.decode("ascii")) if match else _Line(end))
    header.pop("format_version", None)  # whoever writes a recording says what he writes
    return header, damaged, samples


def _entry(line: bytes) -> dict[str, str]:
    """Read a line of the header; nothing of one that is not whole."""
    text = line.removeprefix(b"\xef\xbb\xbf").decode("utf-8", errors="replace")
    match = None if "\ufffd" in text else _ENTRY.fullmatch(text)
    return {match[1]: match[2]} if match else {}


def _longest_run(times_s: Sequence[float]) -> list[int]:
    """Give the indices of the longest subsequence whose times rise.

    A damaged digit can move one line far ahead: it is left out, not all that come after it.
    """
    ends_s: list[float] = []  # the smallest last time of a run of each length
    last: list[int] = []
    before: list[int] = []
    for index, time_s in enumerate(times_s):
        length = bisect.bisect_left(ends_s, time_s)
        before.append(last[length - 1] if length else -1)
        ends_s[length:] = [time_s, *ends_s[length + 1 :]]
        last[length:] = [index, *last[length + 1 :]]
    run: list[int] = []
    index = last[-1] if last else -1
    while index >= 0:
        run.append(index)
        index = before[index]
    return run[::-1]


def _write(recording: bytes, final: Path) -> None:
    """Write a recording beside its name first, so that the name stands for all of it."""
    unfinished = final.with_name(f".{final.name}.{os.getpid()}.unfinished")
    try:
        with unfinished.open("xb") as stream:
            stream.write(recording)
            stream.flush()
            os.fsync(stream.fileno())
        publish(unfinished, final)
    except OSError as fault:
        raise explain_write_fault(fault, final) from fault
    finally:
        unfinished.unlink(missing_ok=True)


@contextlib.contextmanager
def _opened(part: Path) -> Iterator[None]:
    """Hold an unfinished recording, so that nobody records into it meanwhile."""
    try:
        descriptor = os.open(part, os.O_RDWR | getattr(os, "O_BINARY", 0))
    except FileNotFoundError as fault:
        raise AcquisitionError(f"{part} does not exist") from fault
    try:
        lock_file(descriptor)
        yield
    except BlockingIOError as fault:
        raise AcquisitionError(
            f"a recorder is writing {part} at this moment; stop that recorder first"
        ) from fault
    finally:
        os.close(descriptor)
