"""Read the stored results of the accepted recordings, for the report."""

from collections.abc import Iterator, Mapping

from capsule import files
from capsule.arrays import FloatArray
from capsule.evaluation.cross_validation import folds_of, unlabelled_folds
from capsule.held_out import teaching
from capsule.kinds import Settings
from capsule.names import size_mm, sizes_of
from capsule.page.archive_evidence import Fit
from capsule.page.nearest_templates import FoldParticles
from capsule.page.plot_data import read_plot_data
from capsule.particle import Particle, particles_of
from capsule.results import PLOT_DATA, Results
from capsule.templates import by_size, total

# Scheme of an unlabelled recording: all labelled recordings teach.
ALL = "all"


class StoredRecordings:
    """The accepted recordings of a run of the workflow, as `capsule.page.archive_evidence.Stored`.

    Parameters
    ----------
    results : Results
        The files of all recordings of the archive.
    settings : mapping
        The configuration.
    """

    def __init__(self, results: Results, settings: Settings) -> None:
        self._results, table = results, results.folder / "recordings.csv"
        accepted = files.accepted_recordings(table)
        fitted = teaching(accepted, settings["evaluation"]["held_out"])
        self._fits = results.fits(name for name in fitted if size_mm(name))
        self._particles = particles_of(self._fits)
        self._fitted = {
            name: particle
            for name, particle in self._particles.items()
            if not accepted[name]["no_verdict"]
        }
        sensors = settings["recording"]["sensors"]
        groups = by_size(self._fitted)
        totals = {size: total(groups[size], sensors) for size in sorted(groups)}
        self._templates = self._of_folds(FoldParticles(totals), accepted, settings["evaluation"])
        self._drawn = results.described(PLOT_DATA, accepted, read_plot_data)

    def drawn(self, name: str) -> str:
        """Return what the page shows of the recording alone, as deflated JSON."""
        return self._drawn[name].drawn

    def quality(self, name: str) -> str:
        """Return the recording's quality in words."""
        return self._drawn[name].quality

    def matrix(self, name: str) -> FloatArray:
        """Return the recording's matrix V, (S, L)."""
        return self._results.matrix(name)

    def fit(self, name: str) -> Fit | None:
        """Return the recording's fit; None if it has none, as without a nodule of known size."""
        particle = self._particles.get(name)
        return (self._fits[name], particle) if particle else None

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
    for fold in folds_of(labelled, rules):
        yield fold.scheme, list(fold.judged), sorted(fold.left_out)
    unlabelled = [name for name in accepted if name not in labelled]
    for left_out, judged in unlabelled_folds(unlabelled, accepted):
        yield ALL, judged, sorted(left_out)
