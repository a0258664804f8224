"""Make the outlines of flat parts as DXF and SVG, at true size."""

from collections.abc import Sequence

import numpy as np

from capsule.parts.part import Flat

# Layers of the files, with the colour numbers of DXF: white (black on paper) and red.
CUT, MARK = "CUT", "ENGRAVE"
_COLOURS = {CUT: 7, MARK: 1}
_STROKES = {CUT: "#000000", MARK: "#c00000"}
_MARGIN_MM = 1.0


def dxf_text(flat: Flat) -> str:
    """Return an outline as DXF (release 12, closed polylines, in mm, a layer for each kind)."""
    layers = "".join(
        _groups((0, "LAYER"), (2, name), (70, 0), (62, colour), (6, "CONTINUOUS"))
        for name, colour in _COLOURS.items()
    )
    drawn = "".join(
        _polyline(outline, layer) for layer, outlines in _by_layer(flat) for outline in outlines
    )
    return (
        _groups((0, "SECTION"), (2, "HEADER"), (9, "$ACADVER"), (1, "AC1009"))
        + _groups((9, "$INSUNITS"), (70, 4), (9, "$MEASUREMENT"), (70, 1), (0, "ENDSEC"))
        + _groups((0, "SECTION"), (2, "TABLES"), (0, "TABLE"), (2, "LTYPE"), (70, 1))
        + _groups((0, "LTYPE"), (2, "CONTINUOUS"), (70, 0), (3, "Solid line"), (72, 65), (73, 0))
        + _groups((40, "0.0"), (0, "ENDTAB"))
        + _groups((0, "TABLE"), (2, "LAYER"), (70, len(_COLOURS)))
        + layers
        + _groups((0, "ENDTAB"), (0, "ENDSEC"), (0, "SECTION"), (2, "ENTITIES"))
        + drawn
        + _groups((0, "ENDSEC"), (0, "EOF"))
    )


def _groups(*pairs: tuple[int, object]) -> str:
    return "".join(f"{code}\n{value}\n" for code, value in pairs)


def _polyline(outline: np.ndarray, layer: str) -> str:
    head = _groups((0, "POLYLINE"), (8, layer), (66, 1), (70, 1), (10, 0.0), (20, 0.0), (30, 0.0))
    corners = "".join(
        _groups((0, "VERTEX"), (8, layer), (10, f"{x:.6f}"), (20, f"{y:.6f}"), (30, "0.0"))
        for x, y in outline
    )
    return head + corners + _groups((0, "SEQEND"), (8, layer))


def _by_layer(flat: Flat) -> list[tuple[str, Sequence[np.ndarray]]]:
    return [(CUT, flat.cuts), (MARK, flat.marks)]


def svg_text(name: str, flat: Flat) -> str:
    """Return an outline as SVG at true size; as in the DXF, y points upwards."""
    points = np.vstack(flat.cuts)
    low, high = points.min(axis=0) - _MARGIN_MM, points.max(axis=0) + _MARGIN_MM
    width, height = high - low
    groups = []
    for layer, outlines in _by_layer(flat):
        path = " ".join(
            "M" + " L".join(f"{x - low[0]:.6f},{high[1] - y:.6f}" for x, y in outline) + " Z"
            for outline in outlines
        )
        if path:
            groups.append(
                f'<g id="{layer}" fill="none" stroke="{_STROKES[layer]}" stroke-width="0.1">'
                f'<path d="{path}"/></g>\n'
            )
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width:.6f}mm" height="{height:.6f}mm" '
        f'viewBox="0 0 {width:.6f} {height:.6f}">\n<title>{name}, 1 : 1</title>\n'
        + "".join(groups)
        + "</svg>\n"
    )
