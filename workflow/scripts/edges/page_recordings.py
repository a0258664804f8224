"""Read the stored results of the accepted recordings, for the report."""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from capsule.arrays import FloatArray
from capsule.evaluation.folds import scheme_folds
from capsule.kinds import Settings
from capsule.naming import sizes_of
from capsule.page.nearest_templates import FoldParticles
from capsule.particles import Particle
from capsule.templates import total
from edges import files
from edges.detector_inputs import read_matrix
from edges.evidence_files import read_evidence
from edges.fits import by_size, read_particles

# Scheme of an unlabelled recording: all labelled recordings teach.
ALL = "all"


class StoredRecordings:
    """The accepted recordings of a run of the workflow, as `capsule.page.archive_evidence.Stored`.

    Parameters
    ----------
    results : Path
        The folder of results.
    settings : mapping
        The configuration.
    evidence : sequence of Path
        Files that hold the evidence of the recordings.
    """

    def __init__(self, results: Path, settings: Settings, evidence: Sequence[Path]) -> None:
        self._results, index = results, results / "recordings.csv"
        accepted = files.accepted_recordings(index)
        self._fitted = read_particles(index, results / "fits")
        sensors = settings["recording"]["sensors"]
        groups = by_size(self._fitted)
        totals = {size: total(groups[size], sensors) for size in sorted(groups)}
        self._templates = self._of_folds(FoldParticles(totals), accepted, settings["evaluation"])
        self._evidence = read_evidence(evidence, accepted)

    def drawn(self, name: str) -> str:
        """Return what the page shows of the recording alone, as deflated JSON."""
        return self._evidence[name].drawn

    def quality(self, name: str) -> str:
        """Return the recording's quality in words."""
        return self._evidence[name].quality

    def matrix(self, name: str) -> FloatArray:
        """Return the recording's matrix V, (S, L)."""
        return read_matrix(self._results / "matrices", name)

    def templates(self, name: str) -> dict[str, dict[float, Particle]]:
        """Return the averaged particles of each scheme that judged it, by size in mm."""
        return self._templates[name]

    def _of_folds(
        self, folds: FoldParticles, accepted: Mapping[str, Mapping[str, str]], rules: Settings
    ) -> dict[str, dict[str, dict[float, Particle]]]:
        found: dict[str, dict[str, dict[float, Particle]]] = {name: {} for name in accepted}
        for scheme, judged, left_out in _folds_of(accepted, rules):
            # The recordings that a fold judges share its templates.
            averaged = folds.without(
                (size, self._fitted[each])
                for each, size in sizes_of(left_out).items()
                if each in self._fitted
            )
            for name in judged:
                found[name][scheme] = averaged
        return found


def _folds_of(
    accepted: Mapping[str, Mapping[str, str]], rules: Settings
) -> Iterator[tuple[str, list[str], list[str]]]:
    """Yield scheme, judged recordings, and the labelled recordings that do not teach, of folds."""
    labelled = {name: row for name, row in accepted.items() if row["size_mm"]}
    names = list(labelled)
    for folds in scheme_folds(rules["schemes"], labelled, rules["most_folds"]):
        for places in folds.parts():
            judged, left_out = ([names[place] for place in each] for each in places)
            yield folds.scheme, judged, left_out
    for name in accepted.keys() - labelled.keys():
        copies = accepted[name]["near_copies"].split()
        yield ALL, [name], sorted(labelled.keys() & set(copies))
