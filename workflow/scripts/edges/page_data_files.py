"""Write the data files beside the page, which hold the evidence of a large archive."""

from collections.abc import Iterable
from pathlib import Path

from capsule.kinds import Cells
from capsule.page import beside
from edges import files


class DataFiles:
    """The folder beside the page, which has the page's name.

    Parameters
    ----------
    folder : Path
        ``results/report`` for the page ``results/report.html``.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    def write(self, evidence: Iterable[tuple[str, str]]) -> Cells:
        """Write the files, with only a few recordings in memory at a time.

        Parameters
        ----------
        evidence : iterable of (str, str)
            Pairs from `capsule.page.evidence.archive_evidence`.

        Returns
        -------
        dict
            Values for the page's scripts: ``folder``, ``files``, and ``each``, the number of
            recordings in one file.
        """
        self._folder.mkdir(parents=True, exist_ok=True)
        names = []
        for name, script in beside.data_files(evidence):
            with files.write_whole(self._folder / f"{name}.js") as stream:
                stream.write(script)
            names.append(name)
        return {"folder": self._folder.name, "files": names, "each": beside.RECORDINGS_A_FILE}
