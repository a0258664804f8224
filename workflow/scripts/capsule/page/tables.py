"""The tables of results that the page shows."""

from collections.abc import Sequence
from dataclasses import dataclass

import pandas as pd

from capsule.evaluation.archive_rates import Rates
from capsule.kinds import Row


@dataclass(frozen=True)
class Tables(Rates):
    """The tables of results that the page shows, besides the rates.

    Attributes
    ----------
    passed_over, detections, sites : DataFrame
        results/passed_over.csv, detections.csv and sites.csv.
    templates : sequence of mapping
        Those of results/templates.json.
    learning : DataFrame
        The rates reached with parts of the archive, from `capsule.evaluation.learning`.
    benches : sequence of mapping
        The detectors' rates on other benches, from workflow/report/benches.csv.
    references : str
        workflow/report/references.bib.
    """

    passed_over: pd.DataFrame
    detections: pd.DataFrame
    sites: pd.DataFrame
    templates: Sequence[Row]
    learning: pd.DataFrame
    benches: Sequence[Row]
    references: str
