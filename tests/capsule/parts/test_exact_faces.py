"""The faces for STEP files are right, before a CAD library writes them."""

from collections import Counter

import numpy as np
import pytest
from scipy.interpolate import BSpline

from capsule.geometry.cam import Cam
from capsule.parts.all_parts import all_parts
from capsule.parts.command import read_design
from capsule.parts.design import volume
from capsule.parts.exact_faces import DEGREE, cam_surface, plane_faces
from capsule.parts.files import shipped_design

pytestmark = pytest.mark.takes(0.1)

PRISMS = [
    "substructure",
    "coupon-wall-0.50",
    "coupon-strip",
    "coupon-awn",
    "coupon-glue",
    "slide",
    "end-plate",
]


@pytest.fixture(scope="module")
def parts():
    return {part.name: part for part in all_parts(shipped_design(), 4)}


@pytest.fixture(scope="module")
def faces(parts):
    return {
        name: plane_faces(part.vertices, part.triangles)
        for name, part in parts.items()
        if part.spiral is None
    }


def area_vector(points):
    return np.cross(points, np.roll(points, -1, axis=0)).sum(axis=0) / 2


def test_every_face_is_plane_and_begins_with_its_outline(parts, faces):
    for name, of_part in faces.items():
        vertices = parts[name].vertices
        for face in of_part:
            levels = np.concatenate([vertices[loop] @ face.normal for loop in face.loops])
            assert np.ptp(levels) < 1e-6, name
            areas = [area_vector(vertices[loop]) @ face.normal for loop in face.loops]
            assert areas[0] > 0, name
            assert all(area < 0 for area in areas[1:]), name
            assert sum(areas) > 0, name


def test_every_edge_belongs_to_two_faces_that_run_along_it_in_both_directions(faces):
    for name, of_part in faces.items():
        edges = Counter(
            pair
            for face in of_part
            for loop in face.loops
            for pair in zip(loop.tolist(), np.roll(loop, -1).tolist(), strict=True)
        )
        assert set(edges.values()) == {1}, name
        assert {(end, start) for start, end in edges} == set(edges), name


def test_the_faces_enclose_the_meshs_volume(parts, faces):
    for name, of_part in faces.items():
        vertices = parts[name].vertices
        enclosed = sum(
            vertices[face.loops[0][0]] @ face.normal * (area_vector(vertices[loop]) @ face.normal)
            for face in of_part
            for loop in face.loops
        )
        assert enclosed / 3 == pytest.approx(volume(parts[name]), rel=1e-9), name


@pytest.mark.parametrize("name", PRISMS)
def test_a_prism_has_two_ends_and_a_side_for_each_edge_of_its_outline(parts, faces, name):
    cuts = parts[name].flat.cuts
    ends = [face for face in faces[name] if abs(face.normal[2]) > 0.5]
    sides = [face for face in faces[name] if face.normal[2] == 0.0]
    assert (len(ends), len(sides)) == (2, len(np.vstack(cuts)))
    assert len(faces[name]) == len(ends) + len(sides)
    # Holes go through from end to end.
    assert [len(face.loops) for face in ends] == [len(cuts)] * 2
    for end in ends:
        corners = parts[name].vertices[np.concatenate(end.loops), :2]
        away = np.linalg.norm(corners[:, np.newaxis] - np.vstack(cuts), axis=2)
        assert max(away.min(axis=0).max(), away.min(axis=1).max()) < 1e-8


def test_no_face_of_a_follower_is_in_pieces(faces):
    # Four sides without, two ends, and in the window a bevel to either side of a ridge, two flat.
    assert len(faces["follower"]) == 4 + 2 + 4 + 2


def test_variants_keep_their_faces_closed():
    design = read_design(["choice.folding=eyelets", "choice.tip=curl", "choice.fold_side=tail"])
    unit = all_parts(design, 2)[0]
    edges = {
        pair
        for face in plane_faces(unit.vertices, unit.triangles)
        for loop in face.loops
        for pair in zip(loop.tolist(), np.roll(loop, -1).tolist(), strict=True)
    }
    assert {(end, start) for start, end in edges} == edges


@pytest.mark.parametrize("cam", [Cam(9.0, 3.5, 80.0), Cam(20.0, 6.0, 30.0)], ids=str)
def test_the_cams_surface_is_the_circle_along_the_helix(cam):
    knots, poles = cam_surface(cam)
    at = np.linspace(0.0, 1.0, 501)
    points = BSpline(knots, BSpline(knots, poles, DEGREE)(at).swapaxes(0, 1), DEGREE)(at)
    lag = 2 * np.pi * points[..., 2] / cam.lead_mm
    centre = cam.eccentricity_mm * np.stack([np.cos(lag), -np.sin(lag)], axis=-1)
    away = np.linalg.norm(points[..., :2] - centre, axis=-1)
    np.testing.assert_allclose(away, cam.radius_mm, atol=1e-4)
    # The seam, where u begins and ends, is closed.
    np.testing.assert_allclose(poles[0], poles[-1], atol=1e-12)
