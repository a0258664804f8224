"""Make an XDF file according to specification 1.0 (github.com/sccn/xdf, Specifications).

A file is ``XDF:``, followed by chunks. A chunk holds the number of bytes of the length, the length,
a tag of two bytes, and the content. A sample holds a mark for a time stamp, the time stamp, and the
values.
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
    """Return a stream of numbers: (C, K) values of C channels, at K stamps of the sender's clock.

    The recorder's clock is ahead of the sender's by `offset_s`.
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


def xdf_file(*streams: bytes, started: str = "2026-03-04T12:00:00+0000") -> bytes:
    """Return the content of a file with the streams."""
    head = f"<?xml version='1.0'?><info><version>1.0</version><datetime>{started}</datetime></info>"
    return b"XDF:" + _chunk(_FILE_HEADER, head.encode()) + b"".join(streams)
