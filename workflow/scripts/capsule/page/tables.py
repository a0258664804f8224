"""The tables of results that the page shows."""

from collections.abc import Sequence
from dataclasses import dataclass

import pandas as pd

from capsule.evaluation.archive_rates import Rates
from capsule.kinds import Row


@dataclass(frozen=True)
class Tables(Rates):
    """The tables of results that the page shows, besides the rates.

    `learning` is from `capsule.evaluation.learning`; `benches` and `references` are
    workflow/report/benches.csv and references.bib.
    """

    passed_over: pd.DataFrame
    detections: pd.DataFrame
    sites: pd.DataFrame
    templates: Sequence[Row]
    learning: pd.DataFrame
    benches: Sequence[Row]
    references: str
