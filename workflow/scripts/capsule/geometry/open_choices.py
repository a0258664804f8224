"""Name the choices that the paper leaves open about one substructure."""

from dataclasses import dataclass

# A guide eyelet for folding cables (not in the paper): its bore, and its distance from the axis.
EYELET_MM = 0.8
EYELET_AT_MM = 1.0


@dataclass(frozen=True)
class Choices:
    """The choices of a design; ``config/parts.yaml`` gives the default of each.

    Attributes
    ----------
    fold_side
        Side of the line BC with the fold A: ``head`` or ``tail``.
    lower_corner_mm
        Distance from the axis to the corner B.
    corners
        Position of the corners: on the wall's ``middle`` or on its ``outside``.
    tip
        End of the awn: a ``bulb`` of the tip radius, a ``round`` wall end, or a wall that ends in
        a ``curl`` of the tip radius. All are inside the width w.
    current
        Path of the current between the two wires: the whole ``loop`` from one side of the cut to
        the other, or the two ``halves`` in parallel.
    cut
        The flat that is cut if the current takes the loop: at the ``tail`` or the ``head``.
    folding
        ``none``, or ``eyelets``: holes in the flats that guide a cable (not in the paper).
    """

    fold_side: str
    lower_corner_mm: float
    corners: str
    tip: str
    current: str
    cut: str
    folding: str
