"""Write the data files beside the page, which hold the evidence of a large archive."""

from collections.abc import Iterable
from pathlib import Path

from capsule.kinds import Cells
from capsule.page import beside
from capsule.page.archive_evidence import Evidence
from capsule.page.packing import deflated
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

    def write(self, evidence: Iterable[Evidence]) -> Cells:
        """Write the files, with only a few recordings in memory at a time.

        Parameters
        ----------
        evidence : iterable of Evidence
            From `capsule.page.archive_evidence.archive_evidence`.

        Returns
        -------
        dict
            Values for the page's scripts: ``folder``, ``files``, and ``each``, the number of
            recordings in one file.
        """
        self._folder.mkdir(parents=True, exist_ok=True)
        names = []
        texts = ((each.alone, deflated(each.among_others)) for each in evidence)
        for name, script in beside.data_files(texts):
            with files.write_whole(self._folder / f"{name}.js") as stream:
                stream.write(script)
            names.append(name)
        return {"folder": self._folder.name, "files": names, "each": beside.RECORDINGS_A_FILE}
