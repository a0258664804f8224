"""All figures by name: their data, and how to draw each at a width."""

from collections.abc import Callable, Mapping, Sequence
from functools import partial

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from capsule.evaluation import points
from capsule.evaluation.beside_paper import Evaluation
from capsule.evaluation.folds import main_scheme
from capsule.figures import draw_preprocessing
from capsule.figures.draw_confusion import draw_confusion
from capsule.figures.draw_rates import draw_rates
from capsule.figures.draw_roc import curve_table, draw_roc
from capsule.figures.draw_templates import draw_templates, template_table
from capsule.stages import PreprocessedRun

# The data of a figure, and what draws it: it takes the width in inches.
Drawing = tuple[pd.DataFrame, Callable[[float], Figure]]


def preprocessing_drawing(runs: Sequence[PreprocessedRun | None], settings: Mapping) -> Drawing:
    """Give the stages of pre-processing of some runs; the configuration tells the threshold."""
    threshold = settings["preprocessing"]["threshold"]
    return (
        draw_preprocessing.example_table(runs),
        lambda width: draw_preprocessing.draw_preprocessing(runs, threshold, width),
    )


def templates_drawing(templates: Mapping[float, np.ndarray], counts: Sequence[int]) -> Drawing:
    """Give the templates, (S, L) by size in mm, each the average of so many recordings."""
    sizes_mm, matrices = list(templates), list(templates.values())
    return (
        template_table(sizes_mm, matrices),
        lambda width: draw_templates(sizes_mm, matrices, counts, width),
    )


def roc_drawing(
    evaluation: Evaluation, judgements: Mapping[str, pd.DataFrame], settings: Mapping
) -> Drawing:
    """Give the curves of all detectors from the tables ``roc``, ``summary``, ``predictive_values``.

    The scheme is the main one of the configuration.
    """
    curves = curve_table(
        *(judgements[name] for name in ("roc", "summary", "predictive_values")),
        main_scheme(settings["evaluation"]["schemes"]),
    )
    return curves, lambda width: draw_roc(curves, evaluation.detectors(), width)


def rates_drawing(name: str, evaluation: Evaluation, settings: Mapping) -> Drawing:
    """Give one of the figures of rates: ours, of the first detector, beside the paper's.

    Parameters
    ----------
    name : {"detection", "sizing", "negatives", "confusion"}
        Which; the last shows no rates of the paper.
    evaluation : Evaluation
        The tables, ours and the paper's.
    settings : mapping
        The configuration, or its section ``evaluation`` under this name.
    """
    judged, sizes_mm = settings["evaluation"], evaluation.sizes_mm()
    detector = evaluation.detectors()[0]
    tables = partial(evaluation.of, detector=detector, with_paper=True)
    true_size = "size of the nodule (mm)"
    if name == "confusion":
        counts = evaluation.of("confusion", detector)
        return counts, lambda width: draw_confusion(counts, judged["schemes"], sizes_mm, width)
    if name == "detection":
        table = points.detection_points(tables("detection"))
        panels = {"precision": "precision", "recall": "recall"}
        shown, label = sizes_mm[1:], true_size
    elif name == "sizing":
        table = points.sizing_points(tables("sizing"))
        within = f"within {judged['tolerance_mm']:g} mm (*: one-sided)"
        panels = {"exact_rate": "exact size", "within_rate": within}
        shown, label = sizes_mm[1:], true_size
    elif name == "negatives":
        table = points.negative_points(tables("confusion"), judged["confidence"])
        panels = {"classified": "recordings without a nodule, by verdict"}
        shown, label = sizes_mm, "predicted size (mm)"
    else:
        raise ValueError(f"there is no figure {name}")
    return table, lambda width: draw_rates(table, panels, shown, label, width)
