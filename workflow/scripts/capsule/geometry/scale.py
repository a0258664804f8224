"""Draw the scale on the platform: one line per millimetre, one number per centimetre."""

from capsule.arrays import FloatArray
from capsule.geometry.stand import rectangle

# Width of a line, and the lengths of the lines at 1, 5 and 10 mm.
LINE_MM = 0.4
_LENGTHS_MM = {10: 4.0, 5: 3.0, 1: 2.0}
_DIGIT_MM = (1.5, 3.0)
# The bars of each digit, of seven: top, upper left, upper right, middle, lower left, lower right,
# bottom.
_BARS = ("1110111", "0010010", "1011101", "1011011", "0111010", "1101011", "1101111", "1010010",
         "1111111", "1111011")  # fmt: skip


def _digit(digit: int, left: float, low: float) -> list[FloatArray]:
    wide, high = _DIGIT_MM
    middle, line = high / 2, LINE_MM
    bars = [
        (0.0, high - line, wide, high),
        (0.0, middle, line, high),
        (wide - line, middle, wide, high),
        (0.0, middle - line / 2, wide, middle + line / 2),
        (0.0, 0.0, line, middle),
        (wide - line, 0.0, wide, middle),
        (0.0, 0.0, wide, line),
    ]
    drawn = [bar for bar, on in zip(bars, _BARS[digit], strict=True) if on == "1"]
    return [rectangle(left + a, low + b, left + c, low + d) for a, b, c, d in drawn]


def scale_marks(length_mm: float, width_mm: float) -> list[FloatArray]:
    """Return the lines and digits of a scale, each a rectangle, in (x, y).

    Parameters
    ----------
    length_mm
        Length of the scale; it begins at ``-length_mm / 2``.
    width_mm
        Width of the platform; the lines begin at its edge.
    """
    marks = []
    edge = -width_mm / 2
    for position in range(round(length_mm) + 1):
        at = position - length_mm / 2
        length = next(size for step, size in _LENGTHS_MM.items() if position % step == 0)
        # A line begins beyond the edge, so that its end is open there.
        marks.append(rectangle(at - LINE_MM / 2, edge - 0.5, at + LINE_MM / 2, edge + length))
        if position % 10 == 0:
            text = str(position)
            left = at - (len(text) * (_DIGIT_MM[0] + LINE_MM) - LINE_MM) / 2
            for place, digit in enumerate(text):
                offset = left + place * (_DIGIT_MM[0] + LINE_MM)
                marks += _digit(int(digit), offset, edge + _LENGTHS_MM[10] + 0.6)
    return marks
