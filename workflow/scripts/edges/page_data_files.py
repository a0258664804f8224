"""The files beside the page, in which the evidence of a large archive stands."""

from collections.abc import Iterable
from pathlib import Path

from capsule.kinds import Cells
from capsule.page import beside
from edges import files


class DataFiles:
    """The folder beside the page, named as the page is.

    Parameters
    ----------
    folder : Path
        For ``results/report.html`` it is ``results/report``.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    def write(self, evidence: Iterable[tuple[str, str]]) -> Cells:
        """Write the files, a few recordings in memory at a time.

        Parameters
        ----------
        evidence : iterable of (str, str)
            From `capsule.page.evidence.archive_evidence`.

        Returns
        -------
        dict
            What the page's scripts read them by: ``folder``, ``files`` and, of how many recordings
            in their order a file is made, ``each``.
        """
        self._folder.mkdir(parents=True, exist_ok=True)
        names = []
        for name, script in beside.data_files(evidence):
            with files.write_whole(self._folder / f"{name}.js") as stream:
                stream.write(script)
            names.append(name)
        return {"folder": self._folder.name, "files": names, "each": beside.RECORDINGS_A_FILE}
