"""Compare what two projects hold of each recording, whatever the size of their batches."""

from collections.abc import Sequence

import numpy as np

from capsule.store.results import Results
from support.project import Project

# Results that hold all recordings; the others have a file for each batch, which the lists name.
OF_ALL = ("evaluation/", "figures/", "templates")
OF_ALL += ("detections.csv", "detectors.json", "sites.csv")


def results_of_all(project: Project) -> dict[str, bytes]:
    """Return the content of the results that hold all recordings."""
    made = project.result_bytes()
    return {name: content for name, content in made.items() if name.startswith(OF_ALL)}


def assert_same_recordings(project: Project, other: Project, names: Sequence[str]) -> None:
    """Assert that two projects hold the same of some recordings, to the bit."""
    ours, theirs = map(_results_of, (project, other))
    for name in names:
        np.testing.assert_array_equal(ours.signal(name), theirs.signal(name))
        np.testing.assert_array_equal(ours.matrix(name), theirs.matrix(name))
    assert ours.checks(names) == theirs.checks(names)
    nodules = [name for name in names if not name.startswith("0mm")]
    assert ours.fits(nodules) == theirs.fits(nodules)


def _results_of(project: Project) -> Results:
    return Results.of_table(project.results, project.results / "recordings.csv")
