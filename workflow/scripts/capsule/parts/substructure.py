"""Compute one substructure as a closed wall: middle lines, outline, length, cut and wires.

Coordinates are as in `capsule.phantom.origami`. The module computes one half; the other half is
its mirror image.
"""

from dataclasses import dataclass, replace

import numpy as np

from capsule.arrays import FloatArray
from capsule.parts.outlines import arc, mirrored, polygon, reverse, signed_area
from capsule.phantom.origami import Origami, end_radius, half_width, vertices

# A guide eyelet for folding cables (not in the paper): its bore, and its distance from the axis.
EYELET_MM = 0.8
EYELET_AT_MM = 1.0
# Angle of a curled awn's end, which points back into the lumen, away from the wall.
_CURL_END_RAD = np.radians(135.0)
_UP = np.array([0.0, 1.0])


@dataclass(frozen=True)
class Choices:
    """The choices about cut, wires and cables, as in config/parts.yaml."""

    current: str
    cut: str
    folding: str


@dataclass(frozen=True)
class Shape:
    """The middle lines of one half of a substructure, at rest or folded.

    Attributes
    ----------
    fold, lower, shoulder
        The corners A, B and C on the middle of the wall, each of shape (2,), in mm.
    cap, cap_radius_mm
        Centre of the arc that ends the awn, shape (2,), and its radius on the outer side.
    tilt_rad, turn_rad
        Tilt of the line BD to the tail, and the part of it since rest.
    wall_mm, tip
        Thickness of the wall, and form of the awn's end, as in `Origami`.
    """

    fold: FloatArray
    lower: FloatArray
    shoulder: FloatArray
    cap: FloatArray
    cap_radius_mm: float
    tilt_rad: float
    wall_mm: float
    tip: str
    turn_rad: float = 0.0

    @property
    def side(self) -> float:
        """1 if the fold A is on the head's side of B, -1 if it is on the tail's side."""
        return 1.0 if self.fold[0] > self.lower[0] else -1.0

    @property
    def along(self) -> FloatArray:
        """Direction of the awn, from B to D."""
        return np.array([-np.sin(self.tilt_rad), np.cos(self.tilt_rad)])

    @property
    def headward(self) -> FloatArray:
        """Direction across the awn, to the head."""
        return np.array([np.cos(self.tilt_rad), np.sin(self.tilt_rad)])


def _crossing(
    point: FloatArray, along: FloatArray, other: FloatArray, other_along: FloatArray
) -> FloatArray:
    """Return the crossing of two lines, each given by a point and a direction.

    For parallel lines, return the point of the second line.
    """
    if abs(along[0] * other_along[1] - along[1] * other_along[0]) < 1e-9:
        return other
    step = np.linalg.solve(np.column_stack([along, -other_along]), other - point)[0]
    crossing: FloatArray = point + step * along
    return crossing


def _moved_in(shape: Shape, inward_mm: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the corners A, B, C of the hexagon with all its sides moved inwards."""
    fold, lower, side = shape.fold, shape.lower, shape.side
    slope, steep = shape.shoulder - fold, shape.shoulder - lower
    slope, steep = slope / np.linalg.norm(slope), steep / np.linalg.norm(steep)
    # Seen from A, the inside is to the left of the slope if A is at the head.
    slope_at = fold + inward_mm * side * np.array([-slope[1], slope[0]])
    steep_at = lower + inward_mm * side * np.array([steep[1], -steep[0]])
    along = np.array([inward_mm * side, 0.0])
    return (
        _crossing(slope_at, slope, fold - along, _UP),
        _crossing(steep_at, steep, lower + along, _UP),
        _crossing(slope_at, slope, steep_at, steep),
    )


def shape_of(origami: Origami) -> Shape:
    """Return the middle lines of a substructure at rest."""
    corner = vertices(origami)
    wall, radius = origami.wall_thickness_mm, end_radius(origami)
    tilt = float(np.radians(origami.awn_tilt_deg))
    fold, lower, shoulder = (corner[name] for name in "ABC")
    rest = Shape(fold, lower, shoulder, shoulder, radius, tilt, wall, origami.tip)
    fold, lower, shoulder = _moved_in(rest, 0.0 if origami.corners == "middle" else wall / 2)
    # The centre of a curl is beside the wall; the centre of another end is on the wall's middle.
    beside = radius - wall / 2 if origami.tip == "curl" else 0.0
    foot = shoulder - beside * rest.headward
    cap = foot + rest.along * (half_width(origami) - radius - foot[1]) / rest.along[1]
    return replace(rest, fold=fold, lower=lower, shoulder=shoulder, cap=cap)


def top_mm(shape: Shape) -> float:
    """Return the greatest distance of the awn from the axis, in mm."""
    return float(shape.cap[1] + shape.cap_radius_mm)


def folded(shape: Shape, half_width_mm: float) -> Shape:
    """Return the shape with its awn pressed to a smaller half width.

    The walls AC and BCD keep their lengths and turn about the corners A, B and C. The flats stay
    upright. So the line BCD leans further to the tail, and A moves along the axis.

    Parameters
    ----------
    half_width_mm
        Distance from the axis to the outermost point of the awn.

    Raises
    ------
    ValueError
        If the awn cannot lean that far, or A would leave the wall AC.
    """
    arm = shape.cap - shape.lower
    length = np.linalg.norm(arm)
    rise = (half_width_mm - shape.cap_radius_mm - shape.lower[1]) / length
    slope = shape.shoulder - shape.fold
    if not 0.0 <= rise <= 1.0:
        raise ValueError(f"the awn cannot be pressed to {half_width_mm:g} mm")
    turn = float(np.arccos(rise) + np.arctan2(arm[0], arm[1]))
    turned = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    shoulder = shape.lower + turned @ (shape.shoulder - shape.lower)
    height = shoulder[1] - shape.fold[1]
    if height <= 0:
        raise ValueError(f"at {half_width_mm:g} mm the shoulder C is below the fold A")
    run = np.sqrt(slope @ slope - height**2)
    return replace(
        shape,
        fold=np.array([shoulder[0] + shape.side * run, shape.fold[1]]),
        shoulder=shoulder,
        cap=shape.lower + turned @ arm,
        tilt_rad=shape.tilt_rad + turn,
        turn_rad=shape.turn_rad + turn,
    )


def awn_end(shape: Shape) -> FloatArray:
    """Return the awn's end from head side to tail side, as rows of an outline."""
    half = shape.wall_mm / 2
    radius, tilt, centre = shape.cap_radius_mm, shape.tilt_rad, shape.cap
    if shape.tip != "curl":
        # The circle meets the awn's two sides where it is as wide as the wall.
        neck = np.arccos(min(1.0, half / radius))
        return arc(centre, radius, tilt - neck, tilt + np.pi + neck)
    end = _CURL_END_RAD + shape.turn_rad
    middle = centre + (radius - half) * np.array([np.cos(end), np.sin(end)])
    return np.vstack(
        [
            arc(centre, radius, tilt, end)[:1],
            arc(middle, half, end, end + np.pi)[:1],
            arc(centre, radius - shape.wall_mm, end, tilt),
        ]
    )


def outline(shape: Shape) -> tuple[FloatArray, FloatArray]:
    """Return the wall's outer outline, and the hexagon's inside as a hole."""
    half = shape.wall_mm / 2
    fold, lower, _ = _moved_in(shape, -half)
    hole = _moved_in(shape, half)
    # The point at which the awn's side next to A meets the outside of the wall AC.
    joint = _crossing(
        fold,
        shape.shoulder - shape.fold,
        shape.shoulder + half * shape.side * shape.headward,
        shape.along,
    )
    end = awn_end(shape)
    if shape.side < 0:
        end = reverse(end)
    outer = mirrored(np.vstack([polygon([fold, joint]), end, polygon([lower])]))
    inner = mirrored(polygon([hole[0], hole[2], hole[1]]))
    return (outer, reverse(inner)) if shape.side > 0 else (reverse(outer), inner)


def loop_length(shape: Shape) -> float:
    """Return the length of the hexagon's wall along its middle line, in mm."""
    middle = mirrored(polygon([shape.fold, shape.shoulder, shape.lower]))
    return float(np.linalg.norm(middle - np.roll(middle, 1, axis=0), axis=1).sum())


def wall_area(shape: Shape) -> float:
    """Return the area of the wall's section with the awns, in mm2."""
    return sum(signed_area(boundary) for boundary in outline(shape))


def glue_faces(shape: Shape) -> dict[str, FloatArray]:
    """Return the two flat outer faces that are glued to the neighbours.

    Returns
    -------
    dict of str to array of shape (2, 2)
        ``head`` and ``tail``: lower and upper end of the face, in mm.
    """
    fold, lower, _ = _moved_in(shape, -shape.wall_mm / 2)
    head, tail = (fold, lower) if shape.side > 0 else (lower, fold)
    below = np.array([1.0, -1.0])
    return {"head": np.vstack([head * below, head]), "tail": np.vstack([tail * below, tail])}


def face_to_face(shape: Shape) -> float:
    """Return the distance between the two glue faces, in mm."""
    faces = glue_faces(shape)
    return float(faces["head"][0, 0] - faces["tail"][0, 0])


def cut_lines(shape: Shape, choices: Choices) -> list[FloatArray]:
    """Return the cuts along the axis through the flats, each of shape (2, 2), in mm."""
    faces = glue_faces(shape)
    inward = {"head": -shape.wall_mm, "tail": shape.wall_mm}
    cut = ("tail", "head") if choices.current == "halves" else (choices.cut,)
    return [
        np.array([[faces[flat][0, 0], 0.0], [faces[flat][0, 0] + inward[flat], 0.0]])
        for flat in cut
    ]


def wire_positions(shape: Shape, choices: Choices) -> FloatArray:
    """Return the points at which the two wires enter the wall: shape (2, 2), in mm.

    With one cut, the wires are 1 mm above and below it, and the current takes the whole loop. With
    both flats cut, one wire is in each cut, and the current takes the two halves in parallel.
    """
    middles = [line.mean(axis=0) for line in cut_lines(shape, choices)]
    if choices.current == "halves":
        return np.array(middles)
    beside: FloatArray = middles[0] + np.array([[0.0, 1.0], [0.0, -1.0]])
    return beside
