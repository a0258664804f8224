"""What the paper leaves open about one substructure, as named choices."""

from dataclasses import dataclass

# A guide eyelet of the folding that is ours: its bore, and its distance from the axis.
EYELET_MM = 0.8
EYELET_AT_MM = 1.0


@dataclass(frozen=True)
class Choices:
    """Readings of the paper; ``config/parts.yaml`` gives each a default.

    Attributes
    ----------
    fold_side
        Side of the line BC on which the fold A lies: ``head`` or ``tail``.
    lower_corner_mm
        Distance from the axis to the corner B.
    corners
        Where the corners lie: on the wall's ``middle`` or on its ``outside``.
    tip
        End of the awn: a ``bulb`` of the tip radius, a wall end that is ``round``, or a wall that
        ends in a ``curl`` of the tip radius. Each lies inside the width w.
    current
        What the two wires measure: the whole ``loop`` from one side of the cut to the other, or
        the two ``halves`` beside each other.
    cut
        The flat that is cut when the wires measure the loop: that of the ``tail`` or the ``head``.
    folding
        ``none``, or ``eyelets``: holes in the flats that guide a cable (ours, not the paper's).
    """

    fold_side: str
    lower_corner_mm: float
    corners: str
    tip: str
    current: str
    cut: str
    folding: str
