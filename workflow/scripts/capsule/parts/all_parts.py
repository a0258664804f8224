"""Make all parts of capsule and bench."""

import numpy as np

from capsule.errors import CapsuleError
from capsule.parts.bench_parts import bench_parts
from capsule.parts.capsule_parts import assembly, substructure
from capsule.parts.coupons import coupons
from capsule.parts.design import Design
from capsule.parts.part import Part, extent


def all_parts(design: Design, sensors: int) -> list[Part]:
    """Return all parts; each fits the printer.

    Parameters
    ----------
    sensors
        Number of substructures of a capsule.

    Raises
    ------
    CapsuleError
        If a part is larger than the printer's room; the message names the value to change.
    """
    parts = [
        substructure(design, sensors),
        assembly(design, sensors),
        *coupons(design),
        *bench_parts(design),
    ]
    printing = design.parts.print
    room = np.array([printing.bed_x_mm, printing.bed_y_mm, printing.bed_z_mm])
    for part in parts:
        size = extent(part)
        # A part may be turned on the bed, but not tilted.
        turned = size[[1, 0, 2]]
        if (size > room).any() and (turned > room).any():
            box, space = (" x ".join(f"{each:g}" for each in box.round(1)) for box in (size, room))
            raise CapsuleError(
                f"{part.limited_by} makes the {part.name} too large, {box} mm; the printer has "
                f"room for at most {space} mm; reduce {part.limited_by}"
            )
    return parts
