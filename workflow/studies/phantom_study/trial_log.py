"""Keep the trials of a search in a CSV file, so that no trial is made twice."""

import csv
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path

from capsule import files
from capsule.errors import CapsuleError


class TrialLog:
    """A source of trials that keeps them in a file, so that an interrupted search can continue.

    Parameters
    ----------
    path
        The CSV file with one row for each trial; it need not exist.
    make
        Function ``make(values, seeds)`` that makes one trial for each candidate and seed, in order.

    Raises
    ------
    CapsuleError
        The file is not a log of trials.
    """

    def __init__(
        self, path: Path, make: Callable[[Sequence[Mapping], Sequence[int]], Iterable[dict]]
    ) -> None:
        self._path, self._make = path, make
        self._rows = files.read_csv(path) if path.exists() else []
        if self._rows and not {"stage", "archive_seed"} <= set(self._rows[0]):
            raise CapsuleError(f"{path}: this is not a log of trials; choose another --log")

    def trials(self, stage: str, values: Sequence[Mapping], seeds: Sequence[int]) -> list[dict]:
        """Return the trials of one stage; write each new trial before the next is made.

        Raises
        ------
        CapsuleError
            The file holds trials of other candidates for this stage.
        """
        known = [row for row in self._rows if row["stage"] == stage]
        if len(known) > len(seeds) or any(
            row.get(name) != str(value)
            for row, candidate, seed in zip(known, values, seeds, strict=False)
            for name, value in {"archive_seed": seed, **candidate}.items()
        ):
            raise CapsuleError(
                f"{self._path}: {stage} has other candidates than this search; choose another"
                " --log, or use the seed, numbers and ranges of that log"
            )
        made = self._make(values[len(known) :], seeds[len(known) :])
        return known + [self._append({"stage": stage} | trial) for trial in made]

    def _append(self, row: dict) -> dict:
        self._path.parent.mkdir(parents=True, exist_ok=True)
        with self._path.open("a", encoding="utf-8", newline="") as stream:
            writer = csv.DictWriter(stream, list(row), lineterminator="\n")
            if stream.tell() == 0:
                writer.writeheader()
            writer.writerow(row)
        return row
