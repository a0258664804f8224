"""The detectors, a row each: who needs to know something of a detector reads it here.

A new detector is a module beside this one, and a row below. Imports nothing heavy: the Snakefile
reads it at every start.
"""

from dataclasses import dataclass

from capsule.errors import CapsuleError

# The paper's own detector: always the first, and the one that stands where nothing was judged.
PAPER = "template"


@dataclass(frozen=True)
class Row:
    """What everybody needs to know of a detector.

    Attributes
    ----------
    name : str
        As the configuration and the tables call it.
    summary : str
        What it is, for the table of the configuration.
    sentence : str
        How it decides, for the report.
    module, built_by : str
        The module and its class, a `capsule.detectors.training.Detector`.
    section : str or None
        Its own section of the configuration.
    fixed_threshold : float or None
        The threshold of its score; None for a detector that learns it from healthy recordings.
    by_distance : bool
        Whether its verdict is the shortest distance to a template.
    by_templates : bool
        Whether it lays templates on recordings: to judge many anew, with many left out of the
        templates, takes too long for every report.
    by_features : bool
        Whether it judges by the taught scorer's features.
    drawn : tuple of str
        What the report draws of how it judged a recording, beside score and threshold:
        ``template``, ``beats``, ``passing`` (when each sensor passes the place), ``gut`` and
        ``stretches``, as in workflow/report/scripts/evidence_list.js.
    needs : str
        What it needs beside labelled recordings; empty for nothing.
    """

    name: str
    summary: str
    sentence: str
    module: str
    built_by: str
    section: str | None = None
    fixed_threshold: float | None = None
    by_distance: bool = False
    by_templates: bool = False
    by_features: bool = False
    drawn: tuple[str, ...] = ()
    needs: str = ""


_ROWS = (
    Row(
        name=PAPER,
        summary="the paper's detector, always the first in the list",
        sentence="the paper's rule: the nearest template",
        module="capsule.detectors.template",
        built_by="NearestTemplate",
        fixed_threshold=0.0,
        by_distance=True,
        by_templates=True,
        drawn=("template",),
    ),
    Row(
        name="template_threshold",
        summary="the paper's margin with a learned threshold",
        sentence="the paper's margin against a threshold",
        module="capsule.detectors.template",
        built_by="TemplateMargin",
        by_templates=True,
        drawn=("template",),
    ),
    Row(
        name="diagonal",
        summary="the detector of this project",
        sentence="beats that agree on one place, against a threshold",
        module="capsule.detectors.diagonal",
        built_by="DiagonalDetector",
        section="diagonal",
        drawn=("beats", "passing", "gut"),
        needs="a peristaltic wave on every sensor",
    ),
    Row(
        name="taught",
        summary="a network trained on simulated benches and adapted to the archive",
        sentence="a scorer taught by many simulated benches and adapted to this one",
        module="capsule.detectors.taught",
        built_by="TaughtDetector",
        section="taught",
        by_features=True,
        drawn=("beats", "stretches"),
        needs="three healthy recordings, and four sensors with a peristaltic wave on each",
    ),
)
DETECTORS = {row.name: row for row in _ROWS}


def detector_row(name: str) -> Row:
    """Look up a detector.

    Raises
    ------
    CapsuleError
        There is no such detector; the text lists those that there are.
    """
    if name not in DETECTORS:
        raise CapsuleError(f"there is no detector {name}; allowed are: {', '.join(DETECTORS)}")
    return DETECTORS[name]
