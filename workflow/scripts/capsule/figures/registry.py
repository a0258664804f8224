"""List the figures and the modules that make them.

To add a figure, add a module to this folder, a row below, and an image to the report's template.
This module imports nothing heavy, because the Snakefile reads it at every start.
"""

from dataclasses import dataclass


@dataclass(frozen=True)
class Row:
    """The name of a figure, which is that of its files, and the function that makes it.

    The function takes a `capsule.figures.inputs.FigureInputs` and returns a
    `capsule.figures.style.Drawing`.
    """

    name: str
    module: str
    made_by: str


_ROWS = (
    Row("preprocessing", "capsule.figures.draw_signals", "preprocessing_drawing"),
    Row("templates", "capsule.figures.draw_signals", "templates_drawing"),
    Row("detection", "capsule.figures.draw_rates", "detection_drawing"),
    Row("sizing", "capsule.figures.draw_rates", "sizing_drawing"),
    Row("negatives", "capsule.figures.draw_rates", "negatives_drawing"),
    Row("roc", "capsule.figures.draw_curves", "roc_drawing"),
    Row("learning", "capsule.figures.draw_curves", "learning_drawing"),
)
FIGURES = {row.name: row for row in _ROWS}
