"""Write the data files beside the page, which hold what it draws of a large archive."""

from collections.abc import Callable, Iterable, Sequence
from functools import partial
from pathlib import Path

from capsule import files
from capsule.evaluation.paper import template_sizes_mm
from capsule.kinds import Settings, Spread
from capsule.page import beside
from capsule.page.archive_evidence import (
    Evidence,
    PlacedRow,
    Stored,
    accepted_rows,
    archive_evidence,
)
from capsule.page.beside import FilesBeside
from capsule.page.packing import deflated
from capsule.page.recordings import unjudged_rows, verdicts_by_recording
from capsule.page.sections import Tables


class DataFiles:
    """The folder beside the page, which has the page's name.

    Parameters
    ----------
    folder : Path
        ``results/report`` for the page ``results/report.html``.
    spread : callable
        Calls a function with the recordings of each file, like `map`.
    """

    def __init__(self, folder: Path, spread: Spread = map) -> None:
        self._folder, self._spread = folder, spread

    def write(
        self,
        rows: Sequence[PlacedRow],
        evidence: Callable[[Iterable[PlacedRow]], Iterable[Evidence]],
        stored: Stored,
    ) -> FilesBeside:
        """Write the files, each with only its own recordings in memory.

        Parameters
        ----------
        rows : sequence of PlacedRow
            From `capsule.page.archive_evidence.accepted_rows`.
        evidence : callable
            Returns the evidence of some of these recordings.
        stored : Stored
            The stored results of these recordings.

        Returns
        -------
        FilesBeside
            What the page needs to know of the files.
        """
        self._folder.mkdir(parents=True, exist_ok=True)
        each = beside.RECORDINGS_A_FILE

        def write_file(number: int) -> str:
            some = evidence(rows[number * each : (number + 1) * each])
            texts = ((one.alone, deflated(one.among_others)) for one in some)
            name, script = beside.data_file(number, texts)
            with files.write_whole(self._folder / f"{name}.js") as stream:
                stream.write(script)
            return name

        names = list(self._spread(write_file, range(-(-len(rows) // each))))
        qualities = {row["recording"]: stored.quality(row["recording"]) for _, row in rows}
        return FilesBeside(self._folder.name, names, each, qualities)


def write_beside(
    folder: Path, tables: Tables, stored: Stored, settings: Settings, spread: Spread = map
) -> FilesBeside:
    """Write the files beside the page of a large archive.

    Parameters
    ----------
    folder : Path
        ``results/report`` for the page ``results/report.html``.
    tables : Tables
        The tables that the page shows.
    stored : Stored
        The stored results of the accepted recordings.
    settings : mapping
        The configuration.
    spread : callable
        Calls a function with the recordings of each file, like `map`.

    Returns
    -------
    FilesBeside
        What the page needs to know of the files.
    """
    predictions = tables.evaluation.predictions
    evidence = partial(
        archive_evidence,
        verdicts=verdicts_by_recording(predictions, tables.detections),
        sizes_mm=template_sizes_mm(predictions.columns),
        stored=stored,
        settings=settings,
    )
    rows = accepted_rows(unjudged_rows(tables.index))
    return DataFiles(folder, spread).write(rows, evidence, stored)
