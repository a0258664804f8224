"""All figures of a run: their names, their data, and how to draw each at a width."""

from collections.abc import Callable, Iterator, Mapping, Sequence

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from capsule.figures import points, preprocessing
from capsule.figures.confusion import draw_confusion
from capsule.figures.rates import draw_rates
from capsule.figures.roc import curve_table, draw_roc
from capsule.figures.templates import draw_templates, template_table
from capsule.folds import main_scheme
from capsule.judgements import Evaluation

Drawing = tuple[str, pd.DataFrame, Callable[[float], Figure]]


def drawings(
    evaluation: Evaluation,
    judgements: Mapping[str, pd.DataFrame],
    runs: Sequence[preprocessing.Example | None],
    templates: Mapping[float, np.ndarray],
    counts: Sequence[int],
    settings: Mapping,
) -> Iterator[Drawing]:
    """Give each figure's name, its data and how to draw it at a width.

    Parameters
    ----------
    evaluation : Evaluation
        The tables, ours and the paper's; the first detector is drawn.
    judgements : mapping of str to DataFrame
        Of these tables ``roc``, ``summary`` and ``predictive_values``: all detectors are drawn.
    runs : sequence of Example or None
        The runs of the pre-processing figure.
    templates : mapping of float to (S, L) array
        The templates by size in mm.
    counts : sequence of int
        How many recordings each template is the average of.
    settings : mapping
        Sections ``preprocessing`` and ``evaluation`` of the configuration.

    Yields
    ------
    name : str
    table : DataFrame
    draw : callable
        Takes the width in inches, gives the Figure.
    """
    judged, threshold = settings["evaluation"], settings["preprocessing"]["threshold"]
    sizes_mm, detector = evaluation.sizes_mm(), evaluation.detectors()[0]
    template_sizes, matrices = list(templates), list(templates.values())
    table = preprocessing.example_table(runs)
    yield (
        "preprocessing",
        table,
        lambda width: preprocessing.draw_preprocessing(runs, threshold, width),
    )
    yield (
        "templates",
        template_table(template_sizes, matrices),
        lambda width: draw_templates(template_sizes, matrices, counts, width),
    )
    true_size = "size of the nodule (mm)"
    tolerance = f"within {judged['tolerance_mm']:g} mm (*: one-sided)"
    for name, table, panels, sizes, label in [
        (
            "detection",
            points.detection_points(evaluation.of("detection", detector, with_paper=True)),
            {"precision": "precision", "recall": "recall"},
            sizes_mm[1:],
            true_size,
        ),
        (
            "sizing",
            points.sizing_points(evaluation.of("sizing", detector, with_paper=True)),
            {"exact_rate": "exact size", "within_rate": tolerance},
            sizes_mm[1:],
            true_size,
        ),
        (
            "negatives",
            points.negative_points(
                evaluation.of("confusion", detector, with_paper=True), judged["confidence"]
            ),
            {"classified": "recordings without a nodule, by verdict"},
            sizes_mm,
            "predicted size (mm)",
        ),
    ]:
        yield (
            name,
            table,
            lambda width, p=table, t=panels, s=sizes, x=label: draw_rates(p, t, s, x, width),
        )
    confusion = evaluation.of("confusion", detector)
    yield (
        "confusion",
        confusion,
        lambda width: draw_confusion(confusion, judged["schemes"], sizes_mm, width),
    )
    curves = curve_table(
        *(judgements[name] for name in ("roc", "summary", "predictive_values")),
        main_scheme(judged["schemes"]),
    )
    yield "roc", curves, lambda width: draw_roc(curves, evaluation.detectors(), width)
