"""Read the results that the figures show."""

from collections.abc import Mapping
from functools import cached_property
from pathlib import Path

import pandas as pd

from capsule.arrays import FloatArray
from capsule.evaluation.beside_paper import Evaluation
from capsule.kinds import Settings
from capsule.parts.design import Design
from capsule.stages import PreprocessedRun, preprocess_run
from edges import files
from edges.detector_inputs import read_templates
from edges.part_tables import shipped_design
from edges.results import (
    read_evaluation,
    read_judgements,
    read_learning,
    read_printed,
    read_signal,
)


class StoredResults:
    """The results of a run of the workflow, as `capsule.figures.inputs.FigureInputs`.

    Parameters
    ----------
    results : Path
        The folder of results.
    paper : Path
        paper.yaml.
    settings : mapping
        Sections of the configuration.
    """

    def __init__(self, results: Path, paper: Path, settings: Settings) -> None:
        self._results, self._paper, self.settings = results, paper, settings

    @cached_property
    def evaluation(self) -> Evaluation:
        """The rates of this project and of the paper."""
        confidence = self.settings["evaluation"]["confidence"]
        return read_evaluation(self._results / "evaluation", read_printed(self._paper), confidence)

    @cached_property
    def judgements(self) -> Mapping[str, pd.DataFrame]:
        """The tables that compare the detectors, by name."""
        return read_judgements(self._results / "evaluation")

    @property
    def learning(self) -> pd.DataFrame:
        """The rates that the detectors reach with parts of the archive."""
        return read_learning(self._results / "evaluation")

    @cached_property
    def templates(self) -> Mapping[float, FloatArray]:
        """The template of every size in mm, (S, L); size 0 is the first."""
        return read_templates(self._results / "templates.npz")

    @property
    def template_counts(self) -> list[int]:
        """The number of recordings behind each template."""
        entries = files.read_json(self._results / "templates.json")["templates"]
        return [entry["recordings"] for entry in entries]

    @property
    def design(self) -> Design:
        """The design of the capsule and the bench, with the shipped values."""
        return shipped_design()

    def run(self, name: str, title: str) -> PreprocessedRun:
        """Return an accepted recording after each stage of pre-processing."""
        shape = self.settings["preprocessing"]
        return preprocess_run(
            name,
            title,
            read_signal(self._results / "signals", name),
            rate_hz=self.settings["recording"]["rate_hz"],
            window=shape["window"],
            threshold=shape["threshold"],
        )
