"""The ranges and steps of the particle's parameters that the paper gives."""

from capsule.method.particle import ParameterSpace

PAPER = ParameterSpace(
    amplitude_range=(0.001, 1.5),
    vertical_spread_range=(0.001, 1.0),
    peak_spacing_range=(100, 250),
    horizontal_spread_range=(1, 60),
    continuous_step=0.1,
    integer_step=1,
)
