"""The list of detectors, with the properties that the other modules need.

To add a detector, write a module in this folder and add a row below. This module imports nothing
heavy, because the Snakefile reads it at every start.
"""

from dataclasses import dataclass
from importlib import import_module
from typing import TYPE_CHECKING, Any

from capsule.errors import CapsuleError
from capsule.kinds import Settings

if TYPE_CHECKING:
    from capsule.detectors.base import Detector

# The paper's own detector: always the first, and the default if nothing was judged.
PAPER = "template"


@dataclass(frozen=True)
class Row:
    """The properties of one detector.

    Attributes
    ----------
    name, summary, sentence : str
        Its name in the configuration and in the tables; a short description for the documentation
        of the configuration; and its way of deciding, for the report.
    module, built_by : str
        The module and its class, a `capsule.detectors.base.Detector`.
    fixed_threshold : float or None
        The threshold of the score that stands for the paper's rule, the shortest distance to a
        template; None for a detector that learns it from healthy recordings.
    by_templates : bool
        True if it compares recordings with templates. To judge many recordings anew, each with
        other templates, takes too long for every report.
    drawn : tuple of str
        Parts of its evidence that the report draws, besides score and threshold: ``template``,
        ``beats``, ``passing`` (when each sensor passes the place), ``gut`` and ``stretches``, as
        in workflow/report/scripts/evidence_list.js.
    needs : str
        Its needs besides labelled recordings; empty if there are none.
    """

    name: str
    summary: str
    sentence: str
    module: str
    built_by: str
    fixed_threshold: float | None = None
    by_templates: bool = False
    drawn: tuple[str, ...] = ()
    needs: str = ""


_ROWS = (
    Row(
        name=PAPER,
        summary="the paper's detector, always the first in the list",
        sentence="the paper's rule: the nearest template",
        module="capsule.detectors.shipped",
        built_by="NearestTemplate",
        fixed_threshold=0.0,
        by_templates=True,
        drawn=("template",),
    ),
    Row(
        name="diagonal",
        summary="the detector of this project",
        sentence="beats that agree on one place, against a threshold",
        module="capsule.detectors.shipped",
        built_by="Diagonal",
        drawn=("beats", "passing", "gut"),
        needs="a peristaltic wave on every sensor",
    ),
    Row(
        name="taught",
        summary="a network trained on simulated benches and adapted to the archive",
        sentence="a scorer taught by many simulated benches and adapted to this one",
        module="capsule.detectors.shipped",
        built_by="Taught",
        drawn=("beats", "stretches"),
        needs="four sensors with a peristaltic wave on each",
    ),
)
DETECTORS = {row.name: row for row in _ROWS}


def with_detectors(schema: Settings) -> dict[str, Any]:
    """Return config.schema.json with the names of the detectors and what they are."""
    described = {
        "items": {"enum": list(DETECTORS)},
        "description": "; ".join(f"{row.name}: {row.summary}" for row in _ROWS) + ".",
    }
    keys = schema["properties"]
    return {**schema, "properties": {**keys, "detectors": {**keys["detectors"], **described}}}


def detector_row(name: str) -> Row:
    """Return the properties of a detector; raise `CapsuleError` with the names if there is none."""
    if name not in DETECTORS:
        raise CapsuleError(f"there is no detector {name}; allowed are: {', '.join(DETECTORS)}")
    return DETECTORS[name]


def detector_class(name: str) -> "type[Detector]":
    """Import and return the class of a detector; raise `CapsuleError` if there is none."""
    row = detector_row(name)
    detector: type[Detector] = getattr(import_module(row.module), row.built_by)
    return detector
