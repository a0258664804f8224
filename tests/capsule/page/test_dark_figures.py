"""The colours that the page's figures have in the dark."""

import re

import numpy as np
import pytest
from matplotlib import colormaps
from matplotlib.colors import to_hex, to_rgb

from capsule.figures import style
from capsule.page.dark_figures import INK, PAPER, dark_colour, with_dark_colours
from support.project import ROOT

SVG = (
    b'<?xml version="1.0"?>\n<svg width="9pt"><path style="fill: #ffffff"/>'
    b'<path style="fill: none; stroke: #1a1a1a"/></svg>\n'
)


def luminance(colour):
    """Return the relative luminance of a colour, as WCAG defines it."""
    part = np.array(to_rgb(colour))
    linear = np.where(part <= 0.04045, part / 12.92, ((part + 0.055) / 1.055) ** 2.4)
    return float(linear @ [0.2126, 0.7152, 0.0722])


def contrast(one, other):
    darker, lighter = sorted(map(luminance, (one, other)))
    return (lighter + 0.05) / (darker + 0.05)


def test_an_svg_file_gets_a_rule_a_colour_and_is_the_same_without_them():
    themed = with_dark_colours(SVG)
    (rules,) = re.findall(rb"<style id=\"dark\">.*?</style>", themed)
    assert themed.replace(rules, b"") == SVG
    assert rules == (
        b'<style id="dark">@media (prefers-color-scheme: dark){'
        b'[style*="fill: #ffffff"]{fill:#1b2026!important}'
        b'[style*="stroke: #1a1a1a"]{stroke:#e9ecf0!important}}</style>'
    )


def test_white_is_the_pages_dark_paper_and_ink_its_text():
    css = (ROOT / "workflow/report/report.css").read_text(encoding="utf-8")
    dark = css.partition("prefers-color-scheme: dark")[2].partition("\n}")[0]
    assert dict(re.findall(r"--(paper|ink): (#\w+);", dark)) == {"paper": PAPER, "ink": INK}
    assert (dark_colour("#ffffff"), dark_colour(style.INK)) == (PAPER, INK)


@pytest.mark.parametrize("colour", [style.INK, style.MUTED])
def test_text_can_be_read_in_the_dark(colour):
    assert contrast(dark_colour(colour), PAPER) >= 4.5


@pytest.mark.parametrize(
    "colour",
    [
        *style.SENSOR_COLOURS,
        *(look["color"] for look in style.DETECTOR_LOOKS),
        style.PAPER_LOOK["color"],
    ],
)
def test_lines_and_marks_stand_out_in_the_dark(colour):
    assert contrast(dark_colour(colour), PAPER) >= 3


def test_heights_rise_from_the_dark_paper_to_light():
    ramp = [to_hex(colour) for colour in colormaps[style.COLOURS_OF_HEIGHT](np.linspace(0, 1, 12))]
    heights = [luminance(dark_colour(colour)) for colour in ramp]
    assert np.all(np.diff(heights) > 0)
    assert (
        contrast(dark_colour(ramp[0]), PAPER) < 1.2 and contrast(dark_colour(ramp[-1]), PAPER) > 7
    )
