"""Define what figures show: each result is read when a figure needs it."""

from collections.abc import Mapping
from functools import cached_property

import pandas as pd

from capsule.arrays import FloatArray
from capsule.detectors.files import read_templates
from capsule.engine.project import PROJECT
from capsule.evaluation.files import read_evaluation, read_printed, read_table
from capsule.evaluation.paper import Evaluation
from capsule.kinds import Settings
from capsule.method.preprocessing import PreprocessedRun, preprocess_run
from capsule.store import files
from capsule.store.results import OfArchive, Results


class FigureInputs:
    """The results of a run of the workflow."""

    def __init__(self, results: Results, settings: Settings) -> None:
        self._results, self.settings = results, settings

    @cached_property
    def evaluation(self) -> Evaluation:
        """The rates of this project and of the paper."""
        printed = read_printed(PROJECT / "workflow" / "report" / "paper.yaml")
        confidence = self.settings["evaluation"]["confidence"]
        return read_evaluation(self._results.folder, printed, confidence)

    @property
    def learning(self) -> pd.DataFrame:
        """The rates that the detectors reach with parts of the archive."""
        return read_table(self._results.folder / OfArchive.LEARNING)

    @cached_property
    def templates(self) -> Mapping[float, FloatArray]:
        """The template of every size in mm, (S, L); size 0 is the first."""
        return read_templates(self._results.folder / OfArchive.TEMPLATES)

    @property
    def template_counts(self) -> list[int]:
        """The number of recordings behind each template."""
        path = self._results.folder / OfArchive.TEMPLATE_PARAMETERS
        content = files.read_or_explain(path, files.read_json)
        return [entry["recordings"] for entry in content["templates"]]

    def run(self, name: str, title: str) -> PreprocessedRun:
        """Return an accepted recording after each stage of pre-processing."""
        shape = self.settings["preprocessing"]
        return preprocess_run(
            name,
            title,
            self._results.signal(name),
            rate_hz=self.settings["recording"]["rate_hz"],
            window=shape["window"],
            threshold=shape["threshold"],
        )
