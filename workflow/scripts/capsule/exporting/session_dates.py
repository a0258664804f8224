"""Read the start date of a recording from its header."""

from collections.abc import Mapping
from datetime import UTC, datetime

# NWB requires a date. This one replaces an unknown date, and the file says so.
NO_DATE = datetime(1970, 1, 1, tzinfo=UTC)
UNKNOWN = "session_start_time is not known: 1970-01-01T00:00:00Z stands for it"


def session_start(header: Mapping[str, str]) -> tuple[datetime, str]:
    """Return the start date of a recording, and a remark about an unknown date or time zone."""
    told = header.get("started", "")
    try:
        started = datetime.fromisoformat(told)
    except ValueError:
        return NO_DATE, UNKNOWN + (f" (the header says started: {told!r})" if told else "")
    if started.tzinfo is None:
        return started.replace(tzinfo=UTC), "the header names no time zone; UTC is assumed"
    return started, ""
