"""Add the colours of dark mode to SVG figures.

Only the copies inside the page have these colours. The files in results/figures stay light, for
papers.
"""

import re
from collections.abc import Iterable

import numpy as np

from capsule.arrays import FloatArray

# In dark mode, white becomes the background of a section, and the figures' ink becomes the colour
# of the text. Both colours are those of report.css.
PAPER, INK = "#1b2026", "#e9ecf0"
_WHITE, _FIGURE_INK = "#ffffff", "#1a1a1a"
_COLOUR = re.compile(rb"(fill|stroke): (#[0-9a-f]{6})")
_OPENING = re.compile(rb"<svg\b[^>]*>")
# The Oklab colour space, in which equal steps of lightness look equal (Ottosson 2020). The first
# matrix turns linear sRGB into cone responses; the second turns their cube roots into lightness
# and two axes of colour.
_TO_CONES = np.array(
    [
        [0.4122214708, 0.5363325363, 0.0514459929],
        [0.2119034982, 0.6806995451, 0.1073969566],
        [0.0883024619, 0.2817188376, 0.6299787005],
    ]
)
_TO_LAB = np.array(
    [
        [0.2104542553, 0.7936177850, -0.0040720468],
        [1.9779984951, -2.4285922050, 0.4505937099],
        [0.0259040371, 0.7827717662, -0.8086757660],
    ]
)


def with_dark_colours(svg: bytes) -> bytes:
    """Return an SVG file of matplotlib with colours for a dark page added.

    Parameters
    ----------
    svg : bytes
        Its style attributes give colours as ``fill: #rrggbb`` and ``stroke: #rrggbb``.

    Returns
    -------
    bytes
        The same file with one additional ``style`` element, ``id="dark"``.
    """
    rules = _rules(set(_COLOUR.findall(svg)))
    style = b'<style id="dark">@media (prefers-color-scheme: dark){' + rules + b"}</style>"
    return _OPENING.sub(lambda opening: opening[0] + style, svg, count=1)


def dark_colour(colour: str) -> str:
    """Return a figure's colour in dark mode: the lightness is inverted, the hue is kept.

    Parameters
    ----------
    colour : str
        For example ``#1a1a1a``.

    Returns
    -------
    str
    """
    white, ink, paper, text, lab = (
        _lab_of(each) for each in (_WHITE, _FIGURE_INK, PAPER, INK, colour)
    )
    darkness = (white[0] - lab[0]) / (white[0] - ink[0])
    # White becomes PAPER and the figures' ink becomes INK exactly, with their tints.
    return _colour_of(paper + darkness * (text - paper) + np.array([0.0, lab[1], lab[2]]))


def _rules(colours: Iterable[tuple[bytes, bytes]]) -> bytes:
    """Return CSS rules, one per property and colour; they override the style attributes."""
    return b"".join(
        b'[style*="%b: %b"]{%b:%b!important}'
        % (name, colour, name, dark_colour(colour.decode()).encode())
        for name, colour in sorted(colours)
    )


def _lab_of(colour: str) -> FloatArray:
    """Return lightness and the two axes of colour, (3,)."""
    part = np.array([int(colour[at : at + 2], 16) for at in (1, 3, 5)]) / 255
    linear = np.where(part <= 0.04045, part / 12.92, ((part + 0.055) / 1.055) ** 2.4)
    lab: FloatArray = _TO_LAB @ np.cbrt(_TO_CONES @ linear)
    return lab


def _colour_of(lab: FloatArray) -> str:
    """Return the colour of the given lightness and axes, limited to what a screen can show."""
    linear = np.linalg.solve(_TO_CONES, np.linalg.solve(_TO_LAB, lab) ** 3).clip(0, 1)
    part = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
    return "#" + "".join(f"{round(255 * value):02x}" for value in part)
