"""The figures, a row each: which module makes it.

A new figure is a module beside this one, a row below, and its place in the report's template.
Imports nothing heavy: the Snakefile reads it at every start.
"""

from dataclasses import dataclass

from capsule.errors import CapsuleError


@dataclass(frozen=True)
class Row:
    """What everybody needs to know of a figure.

    Attributes
    ----------
    name : str
        As its files are called.
    module, made_by : str
        The module, and its function: it takes a `capsule.figures.inputs.FigureInputs` and gives a
        `capsule.figures.inputs.Drawing`.
    of_design : bool
        Whether it shows the capsule and the bench as they can be built, and so no result: no
        recording changes it.
    """

    name: str
    module: str
    made_by: str
    of_design: bool = False


_ROWS = (
    Row("preprocessing", "capsule.figures.draw_preprocessing", "preprocessing_drawing"),
    Row("templates", "capsule.figures.draw_templates", "templates_drawing"),
    Row("detection", "capsule.figures.draw_rates", "detection_drawing"),
    Row("sizing", "capsule.figures.draw_rates", "sizing_drawing"),
    Row("negatives", "capsule.figures.draw_rates", "negatives_drawing"),
    Row("roc", "capsule.figures.draw_roc", "roc_drawing"),
    Row("learning", "capsule.figures.draw_learning", "learning_drawing"),
    Row("capsule", "capsule.figures.draw_capsule", "capsule_drawing", of_design=True),
    Row("readings", "capsule.figures.draw_capsule", "readings_drawing", of_design=True),
)
FIGURES = {row.name: row for row in _ROWS}


def figure_row(name: str) -> Row:
    """Look up a figure.

    Raises
    ------
    CapsuleError
        There is no such figure; the text lists those that there are.
    """
    if name not in FIGURES:
        raise CapsuleError(f"there is no figure {name}; allowed are: {', '.join(FIGURES)}")
    return FIGURES[name]
