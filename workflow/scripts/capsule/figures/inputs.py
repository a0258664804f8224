"""Define the inputs of the figures, and make a figure's drawing from them."""

from collections.abc import Callable, Mapping
from importlib import import_module
from typing import Protocol

import pandas as pd
from matplotlib.figure import Figure

from capsule.arrays import FloatArray
from capsule.evaluation.paper import Evaluation
from capsule.figures.registry import figure_row
from capsule.kinds import Settings
from capsule.parts.design import Design
from capsule.preprocessing import PreprocessedRun

# A figure's data, and a function that draws the figure at a width in inches.
Drawing = tuple[pd.DataFrame, Callable[[float], Figure]]


class FigureInputs(Protocol):
    """The results that figures show; each is read when a figure needs it."""

    @property
    def settings(self) -> Settings:
        """Of recording, preprocessing, evaluation and report what figures of one source use."""

    @property
    def evaluation(self) -> Evaluation:
        """The rates, ours and the paper's."""

    @property
    def judgements(self) -> Mapping[str, pd.DataFrame]:
        """The tables by which the detectors are compared, by name."""

    @property
    def learning(self) -> pd.DataFrame:
        """The rates reached with parts of the archive, from `capsule.evaluation.learning`."""

    @property
    def templates(self) -> Mapping[float, FloatArray]:
        """The template of each size in mm, (S, L); size 0 comes first."""

    @property
    def template_counts(self) -> list[int]:
        """Number of recordings that each template averages."""

    @property
    def design(self) -> Design:
        """The buildable design of the capsule and the bench."""

    def run(self, name: str, title: str) -> PreprocessedRun:
        """Return an accepted recording after each stage of pre-processing."""


def make_drawing(name: str, inputs: FigureInputs) -> Drawing:
    """Import the module of a figure, and return its drawing.

    Raises
    ------
    CapsuleError
        If there is no such figure.
    """
    row = figure_row(name)
    make: Callable[[FigureInputs], Drawing] = getattr(import_module(row.module), row.made_by)
    return make(inputs)
