"""The results that the page shows."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import pandas as pd

from capsule.arrays import FloatArray
from capsule.evaluation.archive_rates import ALL, Lead, Rates, leading
from capsule.kinds import Row, Settings


@dataclass(frozen=True)
class Tables(Rates):
    """The results that the page shows, besides the rates.

    `learning` is from `capsule.evaluation.learning`. `benches`, `references` and `printed` are
    workflow/report/benches.csv, references.bib and paper.yaml; `schema` is that of the
    configuration. Of each accepted recording, `described` is from `capsule.page.plot_data`; `fits`
    are those of the recordings that teach, and `matrix` returns the matrix V of one, (S, L).
    """

    passed_over: pd.DataFrame
    detections: pd.DataFrame
    sites: pd.DataFrame
    templates: Sequence[Row]
    learning: pd.DataFrame
    benches: Sequence[Row]
    references: str
    printed: Settings
    schema: Settings
    described: Mapping[str, Row]
    fits: Mapping[str, Row]
    matrix: Callable[[str], FloatArray]

    @cached_property
    def lead(self) -> Lead:
        """The detector whose verdicts the page shows first."""
        summary, settings = self.evaluation.tables["summary"], self.settings
        schemes, named = settings["evaluation"]["schemes"], settings["report"]["lead"]
        return leading(summary, settings["detectors"], schemes, named)

    @cached_property
    def first_verdicts(self) -> pd.DataFrame:
        """The verdicts on each labelled recording by the first scheme that judged it.

        A held-out recording has no verdict by another scheme.
        """
        rows = self.evaluation.predictions
        rank = rows["scheme"].map({name: place for place, name in enumerate(self.schemes)})
        return rows[rank == rank.groupby(rows["recording"]).transform("min")]

    @cached_property
    def by_recording(self) -> Mapping[str, Sequence[Row]]:
        """The verdicts on each recording, one a detector; unlabelled ones have the scheme `ALL`."""
        verdicts: dict[str, list[Row]] = {}
        for table in (self.first_verdicts, self.detections.assign(scheme=ALL)):
            for row in table.to_dict("records"):
                verdicts.setdefault(row["recording"], []).append(row)
        return verdicts
