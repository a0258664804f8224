"""List the figures and the modules that make them.

To add a figure, add a module to this folder, a row below, and an image to the report's template.
This module imports nothing heavy, because the Snakefile reads it at every start.
"""

from dataclasses import dataclass

from capsule.errors import CapsuleError


@dataclass(frozen=True)
class Row:
    """The name of a figure and the function that makes it.

    Attributes
    ----------
    name : str
        The figure's name, which is also the name of its files.
    module, made_by : str
        The module and its function, which takes a `capsule.figures.inputs.FigureInputs` and
        returns a `capsule.figures.inputs.Drawing`.
    drawn_from : {"templates", "evaluation", "comparison", "design"}
        What it shows: the averaged templates; the rates and recordings of the evaluation; how the
        detectors compare; or the design of the capsule and the bench, which no recording changes.
        One job draws all figures of a source, as soon as the source is there.
    """

    name: str
    module: str
    made_by: str
    drawn_from: str


_ROWS = (
    Row(
        "preprocessing", "capsule.figures.draw_preprocessing", "preprocessing_drawing", "evaluation"
    ),
    Row("templates", "capsule.figures.draw_templates", "templates_drawing", "templates"),
    Row("detection", "capsule.figures.draw_rates", "detection_drawing", "evaluation"),
    Row("sizing", "capsule.figures.draw_rates", "sizing_drawing", "evaluation"),
    Row("negatives", "capsule.figures.draw_rates", "negatives_drawing", "evaluation"),
    Row("roc", "capsule.figures.draw_roc", "roc_drawing", "comparison"),
    Row("learning", "capsule.figures.draw_learning", "learning_drawing", "comparison"),
    Row("capsule", "capsule.figures.draw_capsule", "capsule_drawing", "design"),
    Row("readings", "capsule.figures.draw_capsule", "readings_drawing", "design"),
)
FIGURES = {row.name: row for row in _ROWS}
SOURCES = tuple(dict.fromkeys(row.drawn_from for row in _ROWS))


def figure_row(name: str) -> Row:
    """Return the row of a figure.

    Raises
    ------
    CapsuleError
        If there is no such figure; the message lists all figures.
    """
    if name not in FIGURES:
        raise CapsuleError(f"there is no figure {name}; allowed are: {', '.join(FIGURES)}")
    return FIGURES[name]
