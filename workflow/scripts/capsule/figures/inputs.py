"""What the figures are drawn from, and what each of them gives."""

from collections.abc import Callable, Mapping
from importlib import import_module
from typing import Protocol

import pandas as pd
from matplotlib.figure import Figure

from capsule.arrays import FloatArray
from capsule.evaluation.beside_paper import Evaluation
from capsule.figures.registry import figure_row
from capsule.kinds import Settings
from capsule.parts.design import Design
from capsule.stages import PreprocessedRun

# The data of a figure, and what draws it: it takes the width in inches.
Drawing = tuple[pd.DataFrame, Callable[[float], Figure]]


class FigureInputs(Protocol):
    """The results that figures show, each read when a figure asks for it."""

    @property
    def settings(self) -> Settings:
        """Of the configuration ``recording``, ``preprocessing``, ``evaluation`` and ``report``.

        Of the last only ``lead``.
        """

    @property
    def evaluation(self) -> Evaluation:
        """The rates, ours and the paper's."""

    @property
    def judgements(self) -> Mapping[str, pd.DataFrame]:
        """The tables by which the detectors are compared, by name."""

    @property
    def learning(self) -> pd.DataFrame:
        """The rates that parts of the archive reach, by `capsule.evaluation.learning`."""

    @property
    def templates(self) -> Mapping[float, FloatArray]:
        """The template of every size in mm, (S, L), that of 0 first."""

    @property
    def template_counts(self) -> list[int]:
        """How many recordings each template is the average of."""

    @property
    def design(self) -> Design:
        """The capsule and the bench as they can be built."""

    def run(self, name: str, title: str) -> PreprocessedRun:
        """Take an accepted recording through the stages of pre-processing."""


def make_drawing(name: str, inputs: FigureInputs) -> Drawing:
    """Import what makes a figure, and let it.

    Raises
    ------
    CapsuleError
        There is no such figure.
    """
    row = figure_row(name)
    make: Callable[[FigureInputs], Drawing] = getattr(import_module(row.module), row.made_by)
    return make(inputs)
