"""The tables of the evaluation, together with the numbers printed in the paper."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import pandas as pd

from capsule.detectors.registry import PAPER

TABLES = ("detection", "specificity", "sizing", "confusion")


@dataclass(frozen=True)
class Evaluation:
    """The tables under results/evaluation.

    Attributes
    ----------
    predictions : DataFrame
        One row for each recording, detector and scheme.
    tables : dict of str to DataFrame
        ``detection``, ``specificity``, ``sizing`` and ``confusion`` for every detector.
    paper : dict of str to DataFrame
        The paper's tables in the same columns.
    """

    predictions: pd.DataFrame
    tables: Mapping[str, pd.DataFrame]
    paper: Mapping[str, pd.DataFrame]

    def detectors(self) -> list[str]:
        """Return the names of the detectors, or only the paper's own if nothing was judged."""
        return self.predictions["detector"].unique().tolist() or [PAPER]

    def sizes_mm(self) -> list[float]:
        """Return the sizes that have a template, including 0, ascending."""
        return template_sizes_mm(self.predictions.columns)

    def of(self, name: str, detector: str, *, with_paper: bool = False) -> pd.DataFrame:
        """Return one detector's rows of a table, followed by the paper's rows if wanted."""
        table = self.tables[name]
        rows = table[table["detector"] == detector]
        return pd.concat([rows, self.paper[name]], ignore_index=True) if with_paper else rows


def template_sizes_mm(columns: Iterable[str]) -> list[float]:
    """Return the sizes that have a template, including 0, ascending.

    Parameters
    ----------
    columns : iterable of str
        Those of results/evaluation/predictions.csv, which has a column for each template.
    """
    return sorted(
        float(name.removeprefix("rmse_").removesuffix("mm"))
        for name in columns
        if name.startswith("rmse_") and name.endswith("mm")
    )
