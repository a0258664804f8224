"""The figure of the scores: every recording's, by its true size."""

from matplotlib.figure import Figure

from capsule.figures.inputs import FigureInputs
from capsule.figures.style import Drawing, figure_style


def scores_drawing(inputs: FigureInputs) -> Drawing:
    """Return the first detector's scores, and what draws them at a width."""
    predictions = inputs.evaluation.predictions
    table = predictions.drop_duplicates("recording")[["recording", "size_mm", "score"]]

    def draw(width_in: float) -> Figure:
        with figure_style():
            figure = Figure(figsize=(width_in, 2.6), layout="constrained")
            axes = figure.subplots()
            axes.plot(table["size_mm"], table["score"], linestyle="none", marker="o")
            axes.set(xlabel="size of the nodule (mm)", ylabel="score")
        return figure

    return table, draw
