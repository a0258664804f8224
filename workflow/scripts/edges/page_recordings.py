"""Read the stored results of each recording, for the report."""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from capsule.evaluation.folds import scheme_folds
from capsule.kinds import Settings
from capsule.naming import sizes_of
from capsule.page.evidence import Stored
from capsule.page.nearest_templates import fold_particles
from capsule.templates import total
from edges import files
from edges.fits import by_size, read_particles
from edges.results import read_fit, read_signal
from edges.scorer_files import read_stretches

# Scheme of an unlabelled recording: all labelled recordings teach.
ALL = "all"


class StoredRecordings:
    """The accepted recordings of a run of the workflow, read one at a time.

    Parameters
    ----------
    results : Path
        The folder of results.
    settings : mapping
        The configuration.
    stretches : sequence of Path
        Files that hold the stretches of the recordings; empty if no detector uses the taught
        scorer's features.
    """

    def __init__(self, results: Path, settings: Settings, stretches: Sequence[Path]) -> None:
        self._results, index = results, results / "recordings.csv"
        accepted = files.accepted_recordings(index)
        self._particles = read_particles(index, results / "fits")
        sensors = settings["recording"]["sensors"]
        groups = by_size(self._particles)
        self._totals = {size: total(groups[size], sensors) for size in sorted(groups)}
        self._left_out = _left_out(accepted, settings["evaluation"])
        self._stretches = read_stretches(stretches, accepted)

    def __call__(self, name: str) -> Stored:
        """Read the stored results of an accepted recording."""
        check = files.read_json(self._results / "checks" / f"{name}.json")
        templates = {
            scheme: fold_particles(
                self._totals,
                [
                    (size, self._particles[n])
                    for n, size in sizes_of(left_out).items()
                    if n in self._particles
                ],
            )
            for scheme, left_out in self._left_out[name].items()
        }
        return Stored(
            read_signal(self._results / "signals", name),
            check["header"],
            read_fit(self._results / "fits" / f"{name}.json"),
            templates,
            self._stretches.get(name),
            check["at_ends"],
        )


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
