"""The logger's description of itself: compare it with the configuration, and write headers."""

from datetime import datetime
from typing import Any

from capsule.bench.bench_errors import AcquisitionError
from capsule.bench.drive import Wave
from capsule.bench.protocol import Identity


def check_fits(identity: Identity, settings: dict[str, Any]) -> None:
    """Raise an error if the workflow could not read recordings of this logger.

    Parameters
    ----------
    identity : Identity
        The logger's description of itself.
    settings : dict
        Section ``recording`` of the configuration.

    Raises
    ------
    AcquisitionError
        The board has another number of sensors or another rate.
    """
    for entry, key in (("channels", "sensors"), ("rate_hz", "rate_hz")):
        if float(identity.entries[entry]) != settings[key]:
            raise AcquisitionError(
                f"the board has {entry} = {identity.entries[entry]}, but the workflow is "
                f"configured for {settings[key]:g}; change recording.{key} in config/config.yaml, "
                "or use another board"
            )


def header_of(identity: Identity, started: datetime, wave: Wave | None) -> dict[str, str]:
    """Return the header of this logger's recordings, with the wave that this program drives."""
    entries = identity.entries
    header = {
        "source": f"recorded by the {identity.device} board, firmware {entries['firmware']}",
        "rate_hz": entries["rate_hz"],
        "adc_bits": entries["adc_bits"],
        "vref_v": f"{int(entries['vref_mv']) / 1000:g}",
        "series_ohm": entries["series_ohm"],
        "started": moment_text(started),
    }
    return header | wave_entries(wave)


def moment_text(moment: datetime) -> str:
    """Return a time in UTC as text for a header."""
    return moment.isoformat(timespec="seconds").replace("+00:00", "Z")


def wave_entries(wave: Wave | None) -> dict[str, str]:
    """Return a header's lines on the wave that this program drives."""
    if wave is None:
        return {}
    return {"wave_speed_mm_s": f"{wave.speed_mm_s:g}", "wave_direction": wave.direction}
