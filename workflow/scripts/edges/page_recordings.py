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
        self._folds = FoldParticles({size: total(groups[size], sensors) for size in sorted(groups)})
        self._left_out = _left_out(accepted, settings["evaluation"])
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
        return {
            scheme: self._folds.without(
                (size, self._fitted[each])
                for each, size in sizes_of(left_out).items()
                if each in self._fitted
            )
            for scheme, left_out in self._left_out[name].items()
        }


def _left_out(
    accepted: Mapping[str, Mapping[str, str]], rules: Settings
) -> dict[str, dict[str, list[str]]]:
    """Return the labelled recordings that did not teach for each recording and each scheme."""
    labelled = {name: row for name, row in accepted.items() if row["size_mm"]}
    left_out: dict[str, dict[str, list[str]]] = {name: {} for name in accepted}
    for name, scheme, others in _of_folds(labelled, rules):
        left_out[name][scheme] = others
    for name in accepted.keys() - labelled.keys():
        copies = accepted[name]["near_copies"].split()
        left_out[name][ALL] = sorted(labelled.keys() & set(copies))
    return left_out


def _of_folds(
    labelled: Mapping[str, Mapping[str, str]], rules: Settings
) -> Iterator[tuple[str, str, list[str]]]:
    names = list(labelled)
    for folds in scheme_folds(rules["schemes"], labelled, rules["most_folds"]):
        for judged, left_out in folds.parts():
            others = [names[place] for place in left_out]
            for place in judged:
                yield names[place], folds.scheme, others
