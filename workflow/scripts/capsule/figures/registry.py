"""The figures, a row each: what each is drawn from, and by which module.

A new figure is a module beside this one, a row below, and its place in the report's template.
Imports nothing heavy: the Snakefile reads it at every start.
"""

from dataclasses import dataclass

from capsule.errors import CapsuleError
from capsule.evaluation.columns import COLUMNS

# Of these, a table is named as its file under results/evaluation.
RATES = ("predictions", "detection", "specificity", "sizing", "confusion")


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
    tables : tuple of str
        The tables under results/evaluation that it shows.
    templates, signals : bool
        Whether it shows the templates, and the readings of labelled recordings.
    """

    name: str
    module: str
    made_by: str
    tables: tuple[str, ...] = ()
    templates: bool = False
    signals: bool = False


_ROWS = (
    Row(
        "preprocessing",
        "capsule.figures.draw_preprocessing",
        "preprocessing_drawing",
        tables=RATES,
        signals=True,
    ),
    Row("templates", "capsule.figures.draw_templates", "templates_drawing", templates=True),
    Row("detection", "capsule.figures.draw_rates", "detection_drawing", tables=RATES),
    Row("sizing", "capsule.figures.draw_rates", "sizing_drawing", tables=RATES),
    Row("negatives", "capsule.figures.draw_rates", "negatives_drawing", tables=RATES),
    Row("confusion", "capsule.figures.draw_confusion", "confusion_drawing", tables=RATES),
    Row("roc", "capsule.figures.draw_roc", "roc_drawing", tables=(*RATES, *COLUMNS)),
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
        raise CapsuleError(f"there is no figure {name}; known are: {', '.join(FIGURES)}")
    return FIGURES[name]
