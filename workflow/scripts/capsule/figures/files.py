"""Read the results that the figures show, and write the figures with their data."""

from collections.abc import Mapping
from functools import cached_property
from pathlib import Path

import pandas as pd

from capsule import files
from capsule.arrays import FloatArray
from capsule.detectors.files import read_templates
from capsule.evaluation.files import (
    read_evaluation,
    read_judgements,
    read_learning,
    read_printed,
)
from capsule.evaluation.paper import Evaluation
from capsule.figures.inputs import FigureInputs, make_drawing
from capsule.figures.style import COLUMN_WIDTH_IN, PAGE_WIDTH_IN, render_figure
from capsule.kinds import Settings
from capsule.parts.design import Design
from capsule.parts.files import shipped_design
from capsule.preprocessing import PreprocessedRun, preprocess_run
from capsule.results import Results

_WIDTHS = ((PAGE_WIDTH_IN, ""), (COLUMN_WIDTH_IN, "_column"))


class StoredResults:
    """The results of a run of the workflow, as `capsule.figures.inputs.FigureInputs`.

    Parameters
    ----------
    results : Results
        The results.
    paper : Path
        paper.yaml.
    settings : mapping
        Sections of the configuration.
    """

    def __init__(self, results: Results, paper: Path, settings: Settings) -> None:
        self._recordings, self._results = results, results.folder
        self._paper, self.settings = paper, settings

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
            self._recordings.signal(name),
            rate_hz=self.settings["recording"]["rate_hz"],
            window=shape["window"],
            threshold=shape["threshold"],
        )


def write_figure(name: str, inputs: FigureInputs, kind: str, folder: Path) -> str:
    """Draw a figure of `capsule.figures.registry` and write it, with its data.

    Parameters
    ----------
    name : str
        The figure.
    inputs : FigureInputs
        The results that the figures show.
    kind : {"svg", "pdf"}
        The file format.
    folder : Path
        Folder for ``<figure>.<kind>``, ``<figure>_column.<kind>`` and ``<figure>.csv``.

    Returns
    -------
    str
        A line for the log.
    """
    table, draw = make_drawing(name, inputs)
    with files.write_whole(folder / f"{name}.csv") as stream:
        table.to_csv(stream, index=False, lineterminator="\n")
    for width_in, suffix in _WIDTHS:
        picture = render_figure(draw(width_in), kind, name + suffix)
        with files.write_whole(folder / f"{name}{suffix}.{kind}", "wb") as stream:
            stream.write(picture)
    return f"{name}: {len(table)} rows of data"
