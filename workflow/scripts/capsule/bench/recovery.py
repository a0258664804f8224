"""Recover the unfinished recording of a killed recorder.

The recording gets every line that can be read. An unreadable line is skipped and counted, and its
sample is missing. The original file stays unchanged beside the recording, under another name.
"""

import bisect
import os
import re
from collections.abc import Sequence
from pathlib import Path

from capsule.bench.bench_errors import AcquisitionError, NameExistsError
from capsule.bench.growing_file import open_locked, publish, writing
from capsule.recordings.names import PART
from capsule.recordings.recording import column_names, format_header
from capsule.store.files import write_new

KEPT_AS = ".recovered"
# ADC counts, or another unit as Python writes it.
_READING = rb"-?\d{1,15}(\.\d{1,22})?(e[-+]\d{1,3})?"
_ENTRY = re.compile(r"# ([a-z0-9_]+): ([ -~\u00a0-\U0010ffff]+)")


def recover(part: Path, sensors: int) -> str:
    """Recover the unfinished recording of a killed recorder; return in a line what was recovered.

    Raises
    ------
    AcquisitionError
        A recorder is writing the file, it holds no sample, or its name does not end in ``.part``.
    NameExistsError
        There is a recording of that name, or the kept original of an earlier recovery.
    """
    if part.suffix != PART:
        raise AcquisitionError(
            f"{part} is not an unfinished recording: the name of one ends in {PART}"
        )
    final = part.with_name(part.name.removesuffix(PART))
    original = part.with_name(part.name + KEPT_AS)
    for present in (final, original):
        if present.exists():
            raise NameExistsError(
                f"{present} exists; rename it or {part.name}, then run --recover again"
            )
    try:
        locked = open_locked(part)  # so that no recorder writes to it meanwhile
    except FileNotFoundError as fault:
        raise AcquisitionError(f"{part} does not exist; give the path of a {PART} file") from fault
    with os.fdopen(locked, "rb") as stream:
        content = stream.read()
        header, damaged, samples = _read(content, sensors)
        readable = [(end, text) for end, text in samples if text]
        times_s = [float(text.partition(",")[0]) for _, text in readable]
        taken = [readable[index] for index in _longest_run(times_s)]
        if not taken:
            raise AcquisitionError(
                f"{part} holds no sample; there is nothing to recover, and the file is unchanged"
            )
        end = taken[-1][0]
        skipped = damaged + sum(other < end for other, _ in samples) - (len(taken) - 1)
        if skipped:
            header["recovered"] = f"lines skipped because they could not be read: {skipped}"
        lines = "".join(f"{text}\n" for _, text in taken)
        with writing(final):
            write_new(final, (format_header(header, sensors) + lines).encode("utf-8"))
    publish(part, original)
    said = [f"recovered {final}: {len(taken)} samples"]
    if skipped:
        said.append(header["recovered"])
    if dropped := len(content) - end:
        said.append(f"{dropped} bytes at its end left out: not a whole line")
    return "; ".join([*said, f"the original is kept as {original.name}"])


def _read(content: bytes, sensors: int) -> tuple[dict[str, str], int, list[tuple[int, str]]]:
    """Return the header, the number of its damaged lines, and the lines of samples.

    Each line of a sample comes with its end in the file; the text of an unreadable one is empty.
    """
    columns = ",".join(column_names(sensors)).encode()
    sample = rb"\d{1,9}(\.\d{1,6})?((,%b){%d}|,{%d})" % (_READING, sensors, sensors)
    form = re.compile(sample)
    header: dict[str, str] = {}
    samples: list[tuple[int, str]] = []
    damaged, end, in_header = 0, 0, True
    for whole in content.split(b"\n")[:-1]:
        end += len(whole) + 1
        line = whole.removesuffix(b"\r")
        if in_header and not re.fullmatch(rb"[-+0-9.,e]+", line):
            entry = _entry(line)
            header |= entry
            in_header = line != columns
            damaged += in_header and not entry
        else:
            in_header = False
            samples.append((end, line.decode("ascii") if form.fullmatch(line) else ""))
    header.pop("format_version", None)  # the writer of a recording adds its own version
    return header, damaged, samples


def _entry(line: bytes) -> dict[str, str]:
    """Return the entry in a line of the header; empty if the line is damaged."""
    text = line.removeprefix(b"\xef\xbb\xbf").decode("utf-8", errors="replace")
    match = None if "\ufffd" in text else _ENTRY.fullmatch(text)
    return {match[1]: match[2]} if match else {}


def _longest_run(times_s: Sequence[float]) -> list[int]:
    """Return the indices of the longest subsequence with rising times.

    A damaged digit can give one line a much later time. This leaves out that line, not the lines
    after it.
    """
    # Of the runs of each length, the one that ends earliest: its last time, index and predecessor.
    ends_s: list[float] = []
    last: list[int] = []
    before: list[int] = []
    for index, time_s in enumerate(times_s):
        length = bisect.bisect_left(ends_s, time_s)
        before.append(last[length - 1] if length else -1)
        ends_s[length : length + 1] = [time_s]
        last[length : length + 1] = [index]
    run = last[-1:]
    while run and before[run[-1]] >= 0:
        run.append(before[run[-1]])
    return run[::-1]
