"""List the figures and the modules that make them.

To add a figure, add a module to this folder, a line below, and an image to the report's template.
This module imports nothing heavy, because the Snakefile reads it at every start.
"""

# The name of a figure is that of its files. The function `<name>_drawing` of its module takes a
# `capsule.figures.inputs.FigureInputs` and returns a `capsule.figures.style.Drawing`.
FIGURES = {
    "preprocessing": "capsule.figures.draw_signals",
    "templates": "capsule.figures.draw_signals",
    "detection": "capsule.figures.draw_rates",
    "sizing": "capsule.figures.draw_rates",
    "negatives": "capsule.figures.draw_rates",
    "roc": "capsule.figures.draw_rates",
    "learning": "capsule.figures.draw_rates",
}
