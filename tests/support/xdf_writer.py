"""Writes an XDF file, by the format's specification 1.0 (github.com/sccn/xdf, Specifications).

A file is ``XDF:`` and chunks: the number of bytes of the length, the length, a tag of two bytes,
then the content. A sample is a mark whether a time stamp follows, the stamp, then its values.
"""

import struct
from collections.abc import Sequence
from xml.sax.saxutils import escape

import numpy as np

_FILE_HEADER, _STREAM_HEADER, _SAMPLES, _CLOCK_OFFSET, _STREAM_FOOTER = 1, 2, 3, 4, 6


def _chunk(tag: int, content: bytes) -> bytes:
    return b"\x04" + struct.pack("<IH", len(content) + 2, tag) + content


def _stream(tag: int, stream: int, content: bytes) -> bytes:
    return _chunk(tag, struct.pack("<I", stream) + content)


def xdf_stream(
    number: int,
    name: str,
    stamps: np.ndarray,
    values: np.ndarray,
    labels: Sequence[str],
    unit: str,
    offset_s: float = 0.0,
) -> bytes:
    """Write a stream of numbers.

    Parameters
    ----------
    number : int
        The stream's number in the file.
    name : str
        Its name.
    stamps : (K,) array
        Time of each sample in seconds of the sender's clock.
    values : (C, K) array
        The samples.
    labels : sequence of C str
        Names of the channels.
    unit : str
        Their unit.
    offset_s : float
        What the recorder's clock was ahead of the sender's.
    """
    channels = "".join(
        f"<channel><label>{escape(label)}</label><unit>{escape(unit)}</unit></channel>"
        for label in labels
    )
    header = (
        f"<?xml version='1.0'?><info><name>{escape(name)}</name><type>tactile</type>"
        f"<channel_count>{len(labels)}</channel_count><nominal_srate>10</nominal_srate>"
        f"<channel_format>double64</channel_format><created_at>1</created_at>"
        f"<desc><channels>{channels}</channels></desc></info>"
    )
    samples = b"".join(
        b"\x08" + struct.pack(f"<d{len(labels)}d", stamp, *sample)
        for stamp, sample in zip(stamps, values.T, strict=True)
    )
    footer = (
        f"<?xml version='1.0'?><info><first_timestamp>{stamps[0]}</first_timestamp>"
        f"<last_timestamp>{stamps[-1]}</last_timestamp>"
        f"<sample_count>{len(stamps)}</sample_count></info>"
    )
    count = b"\x04" + struct.pack("<I", len(stamps))
    offsets = b"".join(
        _stream(_CLOCK_OFFSET, number, struct.pack("<dd", stamp, offset_s))
        for stamp in (stamps[0], stamps[len(stamps) // 2], stamps[-1])
    )
    return (
        _stream(_STREAM_HEADER, number, header.encode())
        + _stream(_SAMPLES, number, count + samples)
        + offsets
        + _stream(_STREAM_FOOTER, number, footer.encode())
    )


def xdf_file(*streams: bytes) -> bytes:
    """Put streams together to a file."""
    head = (
        "<?xml version='1.0'?><info><version>1.0</version>"
        "<datetime>2026-03-04T12:00:00+0000</datetime></info>"
    )
    return b"XDF:" + _chunk(_FILE_HEADER, head.encode()) + b"".join(streams)
