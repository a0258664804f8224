"""The cam shafts in the files give the motion that firmware and documentation expect."""

import re

import numpy as np
import pytest

from capsule.parts import bench_parts
from capsule.parts.cam import follower_displacement
from capsule.parts.files import read_design
from capsule.parts.solids import one
from support.measured import read_stl, section
from support.project import ROOT

pytestmark = pytest.mark.takes(0.1)

DESIGN = read_design()
CAM = DESIGN.cam
FOLLOWERS_MM = np.arange(1.0, 80.0, 2.0)
TURNS = np.radians(np.arange(0, 360, 15))


def slices(path):
    """Return the points of the cam's section at every follower."""
    triangles, _ = read_stl(path)
    low, high = triangles[:, :, 2].min(axis=1), triangles[:, :, 2].max(axis=1)
    for level in FOLLOWERS_MM + 1e-3:
        yield section(triangles[(low < level) & (high > level)], level).reshape(-1, 2)


def displacement(points):
    """Return the place of a follower, midway between the cam's sides, and the cam's width."""
    across = points @ np.array([np.cos(TURNS), -np.sin(TURNS)])
    return (across.max(axis=0) + across.min(axis=0)) / 2, np.ptp(across, axis=0)


@pytest.fixture(scope="module")
def motions(made):
    return {
        side: np.array([displacement(each) for each in slices(made / f"cam-{side}.stl")])
        for side in ("left", "right")
    }


def test_every_follower_moves_as_a_sine_of_the_amplitude(motions):
    expected = follower_displacement(CAM, FOLLOWERS_MM[:, np.newaxis], TURNS)
    for motion in motions.values():
        moved, width = np.moveaxis(motion, 1, 0)
        np.testing.assert_allclose(moved, expected, atol=0.02)
        amplitude = np.abs((moved * np.exp(-1j * TURNS)).mean(axis=1)) * 2
        np.testing.assert_allclose(amplitude, 3.5, atol=0.02)
        # The window is as wide as the cam, plus its play, whatever the angle.
        np.testing.assert_allclose(width, 18.0, atol=0.02)


def test_the_flats_of_the_two_shafts_are_half_a_turn_apart_so_that_the_walls_mirror(made, motions):
    # Both shafts turn the same way. With their rods' flats alike, the right one runs half a turn
    # ahead: what moves the left followers to the right moves the right ones to the left.
    for side, angle in (("left", 0.0), ("right", 180.0)):
        edges = next(slices(made / f"cam-{side}.stl")).reshape(-1, 2, 2)
        bore = edges[(np.linalg.norm(edges, axis=2) < 3.2).all(axis=1)].mean(axis=1)
        # The flat is where the bore comes nearest to the axis.
        x, y = min(bore, key=np.linalg.norm)
        assert abs(np.degrees(np.arctan2(y, x))) == pytest.approx(angle, abs=1.0)
    left, right = motions["left"][:, 0], motions["right"][:, 0]
    # Turned until the flats point the same way, the right shaft mirrors the left one.
    np.testing.assert_allclose(np.roll(right, len(TURNS) // 2, axis=1), -left, atol=0.01)


@pytest.mark.parametrize("turn_deg", [0, 40, 90, 180, 270, 300])
def test_a_follower_passes_the_cam_and_touches_it_when_it_lags_by_more_than_its_play(turn_deg):
    bench, at = DESIGN.parts.bench, 20.0
    cam = one(bench_parts.cam_solid(DESIGN)).rotate((0.0, 0.0, float(turn_deg)))
    middle = follower_displacement(CAM, np.array(at), np.radians(turn_deg))
    follower = one(bench_parts.follower_solid(DESIGN))

    def overlap(lag_mm):
        shift = (float(middle) + lag_mm, 0.0, at - bench.follower_mm / 2)
        return (cam ^ follower.translate(shift)).volume()

    for side in (-1, 1):
        assert overlap(side * (bench.play_mm - 0.01)) == pytest.approx(0.0, abs=1e-6)
        assert overlap(side * (bench.play_mm + 0.03)) > 0.0


def test_the_parts_agree_with_the_firmware():
    header = (ROOT / "workflow/firmware/peristalsis/motion.h").read_text(encoding="utf-8")
    defined = dict(re.findall(r"#define (\w+) (\d+)L?$", header, re.MULTILINE))
    bench, wall = DESIGN.parts.bench, DESIGN.phantom.wall
    assert bench.motor_teeth / bench.cam_teeth == int(defined["WAVES_PER_MOTOR_TURN"])
    assert CAM.lead_mm * 1000 == int(defined["WAVELENGTH_UM"])
    assert wall.speed_mm_s * 1000 == int(defined["DEFAULT_SPEED_UM_S"])
