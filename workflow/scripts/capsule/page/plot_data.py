"""Make, write and read what the report draws of a recording, whatever the others are."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path

from capsule import files
from capsule.arrays import FloatArray
from capsule.kinds import Row, Settings
from capsule.page.packing import deflated, to_json
from capsule.page.quality import quality_words
from capsule.page.recording_evidence import RecordingResults, recording_evidence
from capsule.page.stretches import Stretches


@dataclass(frozen=True)
class PlotData:
    """The part of what the report shows of a recording that no other recording changes.

    Attributes
    ----------
    quality : str
        Its quality in words.
    drawn : str
        From `capsule.page.recording_evidence`, as JSON that `capsule.page.packing` has deflated.
    """

    quality: str
    drawn: str


def plot_data(
    name: str,
    values: FloatArray,
    check: Row,
    stretches: Stretches | None,
    rate_hz: float,
    settings: Settings,
) -> PlotData:
    """Return what the report draws of one recording.

    Parameters
    ----------
    name : str
        The recording, such as ``3mm/r07``.
    values : (S, K) array
        Its readings on an even grid in time; NaN where a sample is missing.
    check : mapping
        The outcome of its check.
    stretches : Stretches or None
        What the taught score loses without each stretch.
    rate_hz : float
        Sampling rate.
    settings : mapping
        Sections ``preprocessing`` and ``diagonal`` of the configuration.
    """
    results = RecordingResults(values, check, stretches)
    drawn = recording_evidence(name, results, rate_hz, settings)
    return PlotData(quality_words(values, check["at_ends"], rate_hz), deflated(to_json(drawn)))


def write_plot_data(path: Path, drawn: Mapping[str, PlotData]) -> None:
    """Write the plot data of some recordings."""
    files.write_json(path, {name: asdict(each) for name, each in drawn.items()})


def read_plot_data(path: Path) -> dict[str, PlotData]:
    """Read what `write_plot_data` has written."""
    return {name: PlotData(**each) for name, each in files.read_json(path).items()}
