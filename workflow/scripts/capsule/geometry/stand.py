"""Compute the outlines of the bench's plates: followers, slides, platform and end plates.

Coordinates: x runs along the gut, y across it, and z upwards. The axes of both cam shafts and the
middle of the capsule are at z = 0. The middle of the gut is at y = 0. A follower's own coordinates
begin at its shaft, at the middle of its stroke: u runs towards the gut, and z upwards.
"""

from dataclasses import dataclass

import numpy as np

from capsule.arrays import FloatArray
from capsule.geometry.cam import Cam, relief
from capsule.geometry.pulley import shaft_distance


@dataclass(frozen=True)
class Bench:
    """Dimensions of the bench that the paper leaves open; lengths in mm.

    Attributes
    ----------
    length_mm
        Length of the followers' row.
    follower_mm
        Thickness of a follower, and the pitch of the row.
    follower_gap_mm
        Difference between a follower's place in the row and its thickness.
    cam_radius_mm
        Radius of the cam's circle.
    play_mm
        Play between parts that slide, per side.
    fit_mm
        Play of a bore, per side.
    bevel_deg
        Angle of a window's edge from its ridge to the follower's faces.
    frame_mm
        Width of a follower's frame around its window.
    shaft_distance_mm
        Distance between the axes of the cam shafts.
    rod_mm, rod_flat_mm
        Diameter of the steel rod with a flat, and the depth of the flat.
    bearing_mm
        Outer diameter of the rod's bearings.
    plate_mm, slide_mm
        Thickness of end plates and of slides.
    row_play_mm
        Difference in length between the slides and the row.
    platform_width_mm, platform_mm, platform_top_mm
        Width and thickness of the platform, and the height of its upper side.
    cam_teeth, motor_teeth
        Teeth of the pulleys.
    drive_belt_mm
        Length of the belt between motor and cam shaft.
    """

    length_mm: float
    follower_mm: float
    follower_gap_mm: float
    cam_radius_mm: float
    play_mm: float
    fit_mm: float
    bevel_deg: float
    frame_mm: float
    shaft_distance_mm: float
    rod_mm: float
    rod_flat_mm: float
    bearing_mm: float
    plate_mm: float
    slide_mm: float
    row_play_mm: float
    platform_width_mm: float
    platform_mm: float
    platform_top_mm: float
    cam_teeth: int
    motor_teeth: int
    drive_belt_mm: float


@dataclass(frozen=True)
class Window:
    """Half sizes of a follower's window, in mm.

    Attributes
    ----------
    ridge_mm, face_mm
        Half width at the follower's middle, where the window touches the cam, and at its faces.
    height_mm
        Half height.
    """

    ridge_mm: float
    face_mm: float
    height_mm: float


def rectangle(left: float, low: float, right: float, high: float) -> FloatArray:
    """Return a rectangle, anticlockwise: shape (4, 2)."""
    return np.array([[left, low], [right, low], [right, high], [left, high]])


def circle(
    radius_mm: float, centre: tuple[float, float] = (0.0, 0.0), points: int = 96
) -> FloatArray:
    """Return a polygon with the area of a circle, anticlockwise: shape (points, 2)."""
    step = 2 * np.pi / points
    angles = step * np.arange(points)
    radius = radius_mm * np.sqrt(step / np.sin(step))
    polygon: FloatArray = np.array(centre) + radius * np.column_stack(
        [np.cos(angles), np.sin(angles)]
    )
    return polygon


def slot(centre: tuple[float, float], width_mm: float, travel_mm: float) -> FloatArray:
    """Return an upright slot with round ends, anticlockwise: shape (N, 2)."""
    half = np.linspace(0.0, np.pi, 25)
    end = width_mm / 2 * np.column_stack([np.cos(half), np.sin(half)])
    upper = end + np.array([0.0, travel_mm / 2])
    polygon: FloatArray = np.array(centre) + np.vstack([upper, -upper])
    return polygon


def bore(bench: Bench, turned: bool = False) -> FloatArray:
    """Return the bore for the rod: a circle with a flat, which sets the cam's phase.

    Parameters
    ----------
    turned
        Whether the flat is on the side away from the cam's circle, instead of next to it.
    """
    radius = bench.rod_mm / 2 + bench.fit_mm
    flat = bench.rod_mm / 2 - bench.rod_flat_mm + bench.fit_mm
    edge = np.arccos(flat / radius)
    angles = np.linspace(edge, 2 * np.pi - edge, 60)
    points = radius * np.column_stack([np.cos(angles), np.sin(angles)])
    return -points if turned else points


def front(bench: Bench, lumen_mm: float, silicone_mm: float) -> float:
    """Return the distance from a follower's shaft to its front at the silicone, in mm.

    Parameters
    ----------
    lumen_mm
        Distance between the baselines of the two walls.
    silicone_mm
        Thickness of wall and sheet together.
    """
    return (bench.shaft_distance_mm - lumen_mm) / 2 - silicone_mm


def window(bench: Bench, cam: Cam) -> Window:
    """Return the window with which a follower rides on the cam."""
    ridge = cam.radius_mm + bench.play_mm
    thickness = bench.follower_mm - bench.follower_gap_mm
    height = cam.radius_mm + cam.eccentricity_mm + bench.play_mm
    return Window(ridge, ridge + relief(thickness, bench.bevel_deg), height)


def follower_outline(bench: Bench, cam: Cam, front_mm: float) -> tuple[FloatArray, FloatArray]:
    """Return a follower's outer boundary and its window at the faces, in (u, z)."""
    opening = window(bench, cam)
    height = opening.height_mm + bench.frame_mm
    back = opening.face_mm + bench.frame_mm
    outer = rectangle(-back, -height, front_mm, height)
    inner = rectangle(-opening.face_mm, -opening.height_mm, opening.face_mm, opening.height_mm)
    return outer, inner[::-1]


def followers(bench: Bench) -> int:
    """Return the number of followers in one row."""
    return round(bench.length_mm / bench.follower_mm)


def row_length(bench: Bench) -> float:
    """Return the distance between the end plates, in mm."""
    return bench.length_mm + bench.row_play_mm


def slide_levels(bench: Bench, cam: Cam) -> tuple[float, float]:
    """Return the heights of an upper slide's lower and upper side above the shafts, in mm."""
    low = window(bench, cam).height_mm + bench.frame_mm + bench.play_mm
    return low, low + bench.slide_mm


def slide_span(bench: Bench, cam: Cam, front_mm: float) -> tuple[float, float]:
    """Return the ends of a slide in a follower's coordinate u, in mm."""
    back = window(bench, cam).face_mm + bench.frame_mm + cam.eccentricity_mm
    return -back, front_mm + cam.eccentricity_mm


def tab_places(bench: Bench, cam: Cam, front_mm: float) -> list[tuple[float, float]]:
    """Return the ends of the two tabs at a slide's end in a follower's coordinate u, in mm."""
    low, high = slide_span(bench, cam, front_mm)
    width = (high - low) / 4
    return [(low + width / 2, low + 3 * width / 2), (high - 3 * width / 2, high - width / 2)]


def slide_outline(bench: Bench, cam: Cam, front_mm: float) -> FloatArray:
    """Return a slide with its tabs for the end plates, in (x, u), anticlockwise."""
    low, high = slide_span(bench, cam, front_mm)
    half = row_length(bench) / 2
    reach = half + bench.plate_mm
    right = [[half, low]]
    for start, end in tab_places(bench, cam, front_mm):
        right += [[half, start], [reach, start], [reach, end], [half, end]]
    right.append([half, high])
    edge = np.array(right)
    return np.vstack([edge, edge[::-1] * [-1.0, 1.0]])


def platform_outline(bench: Bench) -> FloatArray:
    """Return the platform, including its ends inside the end plates, in (x, y), anticlockwise."""
    half = row_length(bench) / 2 + bench.plate_mm
    return rectangle(-half, -bench.platform_width_mm / 2, half, bench.platform_width_mm / 2)


def motor_height(bench: Bench) -> float:
    """Return the height of the motor's shaft above the cam shaft that it drives, in mm."""
    return shaft_distance(bench.motor_teeth, bench.cam_teeth, bench.drive_belt_mm)


def end_plate(bench: Bench, cam: Cam, front_mm: float) -> tuple[FloatArray, list[FloatArray]]:
    """Return the outline of an end plate and its holes, in (y, z).

    The holes hold the bearings, the slides' tabs, the platform and the motor. The motor's holes are
    slots, so that a user can tighten the belt.
    """
    shaft = bench.shaft_distance_mm / 2
    low, high = slide_levels(bench, cam)
    play = bench.play_mm
    motor = motor_height(bench)
    back = -slide_span(bench, cam, front_mm)[0]
    edge = shaft + back + bench.plate_mm
    outline = rectangle(-edge, -(high + 2 * bench.plate_mm), edge, motor + 24.0)
    holes = []
    for side in (-1.0, 1.0):
        holes.append(circle(bench.bearing_mm / 2 + bench.fit_mm, (side * shaft, 0.0)))
        for start, end in tab_places(bench, cam, front_mm):
            ends = sorted([side * (shaft - start), side * (shaft - end)])
            for levels in ((low, high), (-high, -low)):
                holes.append(
                    rectangle(ends[0] - play, levels[0] - play, ends[1] + play, levels[1] + play)
                )
    half = bench.platform_width_mm / 2 + play
    under = bench.platform_top_mm - bench.platform_mm - play
    holes.append(rectangle(-half, under, half, bench.platform_top_mm + play))
    # 28BYJ-48: the shaft is 8 mm beside the middle of the body; two screws of 4 mm, 35 mm apart.
    holes.append(slot((shaft, motor), 10.0, 6.0))
    holes += [slot((shaft + side * 17.5, motor + 8.0), 4.2, 6.0) for side in (-1.0, 1.0)]
    return outline, [hole[::-1] for hole in holes]
