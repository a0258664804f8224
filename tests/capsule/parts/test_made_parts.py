"""Readers that share no code with the writers measure the files of the parts."""

import csv
import re
import zipfile
from xml.etree import ElementTree

import ezdxf
import numpy as np
import pytest
import trimesh
from ezdxf.fonts.ttfonts import PathPen
from ezdxf.path import make_path
from fontTools.svgLib.path import parse_path
from trimesh.intersections import mesh_plane

from capsule.parts import bench_parts
from capsule.parts.cam import follower_displacement
from capsule.parts.files import read_design
from capsule.parts.solids import one
from support.command import CAPSULE, output_of
from support.project import ROOT

pytestmark = pytest.mark.takes(0.2)

# Worked out of the paper's dimensions by hand: 5 tan 50, 5 tan 5, -3 tan 5.
CORNERS = {"A": (5.9588, 2.0), "B": (0.4374, 2.0), "C": (0.0, 7.0), "D": (-0.2625, 10.0)}
COUPONS = ["strip", "awn", "glue", "wall-0.40", "wall-0.50", "wall-0.60"]
PRISMS = {"substructure": 5.0, **{f"coupon-{name}": 5.0 for name in COUPONS}}
PRISMS |= {"slide": 4.0, "end-plate": 6.0}
UP = [0, 0, 1]
SVG = "{http://www.w3.org/2000/svg}"
MODEL = "{http://schemas.microsoft.com/3dmanufacturing/core/2015/02}"


@pytest.fixture(scope="module")
def meshes(made):
    return {path.stem: trimesh.load_mesh(path) for path in sorted(made.glob("*.stl"))}


def read_3mf(path):
    """Return the mesh of each object of a 3MF by its name, in mm."""
    with zipfile.ZipFile(path) as package:
        model = ElementTree.fromstring(package.read("3D/3dmodel.model"))
    assert model.get("unit") == "millimeter"
    bodies = [*model.iter(f"{MODEL}object")]
    built = [item.get("objectid") for item in model.iter(f"{MODEL}item")]
    assert [body.get("id") for body in bodies] == built

    def numbers(body, kind, keys):
        return np.array([[*map(each.get, keys)] for each in body.iter(MODEL + kind)], dtype=float)

    def mesh(body):
        triangles = numbers(body, "triangle", ["v1", "v2", "v3"])
        return trimesh.Trimesh(numbers(body, "vertex", "xyz"), triangles)

    return {body.get("name"): mesh(body) for body in bodies}


def outlines(path, layer="CUT"):
    """Return a layer's outlines of a DXF or SVG as closed polygons, in mm, with y upwards."""
    height, upwards = 0.0, 1
    if path.suffix == ".dxf":
        polylines = ezdxf.readfile(path).modelspace().query(f"POLYLINE[layer=='{layer}']")
        assert all(each.is_closed for each in polylines)
        paths = map(make_path, polylines)
    else:
        root = ElementTree.fromstring(path.read_text(encoding="utf-8"))
        width, height = (float(root.get(name).removesuffix("mm")) for name in ("width", "height"))
        # One unit of the picture is one millimetre.
        assert [float(each) for each in root.get("viewBox").split()] == [0, 0, width, height]
        (drawn,), upwards = root.find(f"{SVG}g[@id='{layer}']"), -1
        parse_path(drawn.get("d"), pen := PathPen(None))
        paths = pen.path.to_path().sub_paths()
    # The last point closes a path.
    lines = ([(point.x, point.y) for point in each.flattening(1e-4)][:-1] for each in paths)
    return [np.array(each) * [1, upwards] + [0, height] for each in lines]


def edges_of(outlines):
    """Return the edges of closed outlines, shape (N, 2, 2)."""
    return np.vstack([np.stack([each, np.roll(each, -1, axis=0)], axis=1) for each in outlines])


def clearance(points, edges):
    """Return the distance of each point, of shape (..., 2), from the nearest edge."""
    start, way = edges[:, 0], edges[:, 1] - edges[:, 0]
    from_start = points[..., np.newaxis, :] - start
    part = (from_start * way).sum(axis=-1) / (way**2).sum(axis=-1)
    beside = from_start - part.clip(0, 1)[..., np.newaxis] * way
    return np.linalg.norm(beside, axis=-1).min(axis=-1)


@pytest.mark.parametrize("kind", ["stl", "3mf", "dxf", "svg"])
def test_angles_and_corners_are_the_papers_in_every_file(made, meshes, kind):
    path = made / f"substructure.{kind}"
    if kind in ("dxf", "svg"):
        edges = edges_of(outlines(path))
    else:
        mesh = meshes["substructure"] if kind == "stl" else read_3mf(path)["substructure"]
        edges = mesh_plane(mesh, UP, [0, 0, 2.5])[:, :, :2]
    low, high = edges.min(axis=(0, 1)), edges.max(axis=(0, 1))
    assert high[1] - low[1] == pytest.approx(20.0, abs=0.01)
    # An SVG begins at its corner: the axis is half way up, and the foremost point is left of C.
    edges = edges - [low[0] + 1.1742 if kind == "svg" else 0.0, (low[1] + high[1]) / 2]
    corners = {name: np.array(corner) for name, corner in CORNERS.items()}
    corners |= {f"{name}'": corner * [1, -1] for name, corner in corners.items()}
    # Half a wall lies to either side of the middle line between two corners, all along it.
    sides = [("A", "C"), ("B", "C"), ("A'", "C'"), ("B'", "C'"), ("A", "A'"), ("B", "B'")]
    for first, second in (*sides, ("C", "D"), ("C'", "D'")):
        # The awn ends in a bulb.
        end = 0.35 if "D" in second else 0.8
        way = corners[second] - corners[first]
        across = np.array([-way[1], way[0]]) / np.linalg.norm(way)
        along = corners[first] + np.linspace(0.2, end, 9)[:, np.newaxis] * way
        for aside in (-0.2, 0.0, 0.2):
            to_wall = clearance(along + aside * across, edges)
            np.testing.assert_allclose(to_wall, 0.25 - abs(aside), atol=0.01)


def test_every_mesh_is_sound_printable_and_the_same_in_both_files(made, meshes, listed):
    assert set(meshes) == set(listed["parts"])
    for name, mesh in meshes.items():
        part = listed["parts"][name]
        with (made / f"{name}.stl").open("rb") as stream:
            normals = trimesh.exchange.stl.load_stl_binary(stream)["face_normals"]
        assert mesh.is_watertight and mesh.is_winding_consistent, name
        assert mesh.body_count == part["bodies"] == (4 if name == "assembly" else 1), name
        assert mesh.nondegenerate_faces(height=1e-5).all(), name
        turned = trimesh.triangles.normals(mesh.triangles)[0]
        np.testing.assert_allclose(normals, turned, atol=1e-4)
        # Normals that point inwards would make the volume negative.
        assert mesh.volume == pytest.approx(part["volume_mm3"], rel=1e-3), name
        np.testing.assert_allclose(mesh.extents, part["box_mm"], atol=0.01)
        assert mesh.bounds[0, 2] == pytest.approx(0.0, abs=1e-6)
        # It fits the printer and needs no support.
        assert all(mesh.extents <= [250, 210, 210]), name
        downwards = -normals[mesh.triangles[:, :, 2].max(axis=1) > 1e-6, 2]
        overhang = np.degrees(np.arcsin(np.clip(downwards, 0, 1)).max())
        assert overhang <= (20.0 if name.startswith("cam-") else 45.0), name
        read = read_3mf(made / f"{name}.3mf").values()
        assert sum(len(each.faces) for each in read) == len(mesh.faces)
        assert sum(each.volume for each in read) == pytest.approx(mesh.volume, rel=1e-4)


@pytest.mark.parametrize("name", [*PRISMS, "follower", "platform"])
def test_outlines_reopen_at_true_size_and_a_prisms_volume_is_area_times_height(made, listed, name):
    drawing, part = ezdxf.readfile(made / f"{name}.dxf"), listed["parts"][name]
    auditor = drawing.audit()
    assert (auditor.errors, auditor.fixes) == ([], [])
    assert drawing.header["$INSUNITS"] == ezdxf.units.MM
    for kind in ("dxf", "svg"):
        read = outlines(made / f"{name}.{kind}")
        box = np.ptp(np.vstack(read), axis=0)
        np.testing.assert_allclose(box, part["box_mm"][:2], atol=0.01)
        if name in PRISMS:
            areas = [abs(np.linalg.det(edges_of([each])).sum()) / 2 for each in read]
            volume = (2 * max(areas) - sum(areas)) * PRISMS[name]
            assert part["volume_mm3"] == pytest.approx(volume, rel=1e-3)


def test_the_assembly_is_four_sensors_at_a_pitch(made):
    read = read_3mf(made / "assembly.3mf")
    assert list(read) == [f"assembly {n}" for n in (1, 2, 3, 4)]
    heads = [mesh.bounds[1, 0] for mesh in read.values()]
    np.testing.assert_allclose(-np.diff(heads), 6.2713, atol=1e-3)


def test_a_laser_engraves_the_platforms_scale_and_cuts_the_end_plates_rounds_as_arcs(made):
    files = made / "platform.dxf", made / "platform.svg"
    marks, again = (len(outlines(each, "ENGRAVE")) for each in files)
    assert marks == again > 161
    assert [len(outlines(each)) for each in files] == [1, 1]
    lines = ezdxf.readfile(made / "end-plate.dxf").modelspace().query("POLYLINE")
    parts = [part for each in lines for part in each.virtual_entities()]
    radii = [part.dxf.radius for part in parts if part.dxftype() == "ARC"]
    # Two arcs each: two bearings, the motor's shaft and its two screws.
    assert radii == pytest.approx(np.repeat([9.6, 9.6, 5.0, 2.1, 2.1], 2), abs=1e-6)


@pytest.mark.parametrize(
    ("drawing", "part", "sizes", "words"),
    [
        ("substructure", "substructure", "width flats_apart flat_AA flat_BB wall",
         ["5\u00b0", "45\u00b0", "cut", "wire", "7 : 1, in mm"]),
        ("assembly", "assembly", "pitch faces", [*"1234"]),
        ("bench", "cam-left", "radius", ["60", "follower 2"]),
        ("bench", "end-plate", "shaft_distance", []),
        ("follower", "follower", "ridge window_height front thickness", []),
        ("end-plate", "end-plate", "shaft_distance motor_height", []),
        ("cam", "cam-left", "lead eccentricity", []),
    ],
)  # fmt: skip
def test_the_drawn_dimensions_are_the_listed_ones(made, listed, drawing, part, sizes, words):
    lengths = [listed["parts"][part]["sizes"][f"{name}_mm"] for name in sizes.split()]
    wanted = [f"{each:.2f}".rstrip("0").rstrip(".") for each in lengths] + words
    root = ElementTree.fromstring((made / f"drawings/{drawing}.svg").read_text(encoding="utf-8"))
    drawn = ["".join(each.itertext()).strip() for each in root.iter(f"{SVG}text")]
    # Before a length may stand what it is of, as in "pitch = 6.27".
    assert set(wanted) <= {*drawn, *(text.split()[-1] for text in drawn)}
    assert (made / f"drawings/{drawing}.pdf").read_bytes().startswith(b"%PDF")


def test_the_list_gives_mass_loop_and_resistance_and_the_bill_what_is_made_and_bought(made, listed):
    unit, capsule = listed["parts"]["substructure"], listed["capsule"]
    assert unit["mass_g"] == pytest.approx(unit["volume_mm3"] * 1.2e-3, abs=1e-3)
    # Twice |AC| and |BC|, and the two flats.
    loop = 2 * (np.hypot(5.9588, 5.0) + np.hypot(0.4374, 5.0)) + 8.0
    told = [capsule[name] for name in ("loop_mm", "resistance_ohm", "resistivity_ohm_m")]
    assert told == pytest.approx([loop, 12000, 0.9], abs=0.01)
    with (made / "bom.csv").open(encoding="utf-8", newline="") as stream:
        rows = list(csv.DictReader(stream))
    printed = {name: part["quantity"] for name, part in listed["parts"].items() if part["quantity"]}
    billed = {row["item"]: int(row["quantity"]) for row in rows if row["kind"] == "printed"}
    assert billed == printed
    assert (printed["substructure"], printed["follower"], printed["cam-left"]) == (4, 160, 2)
    assert "belt GT2, 6 mm, 160 mm" in [row["item"] for row in rows]


# The cam shafts give the motion that firmware and documentation expect.

DESIGN = read_design()
CAM = DESIGN.cam
FOLLOWERS_MM = np.arange(1.0, 80.0, 2.0)
TURNS = np.radians(np.arange(0, 360, 15))


# Both shafts are the same sine and turn the same way. With their rods' flats alike, the right one
# runs half a turn ahead: what moves the left followers to the right moves the right ones to the
# left, and the walls mirror.
@pytest.mark.parametrize(("side", "flat_deg"), [("left", 0.0), ("right", 180.0)])
def test_every_follower_moves_as_a_sine_from_the_flat_of_its_shaft(meshes, side, flat_deg):
    cam = meshes[f"cam-{side}"]
    edges = [mesh_plane(cam, UP, [0, 0, at + 1e-3])[:, :, :2] for at in FOLLOWERS_MM]
    across = [each.reshape(-1, 2) @ np.array([np.cos(TURNS), -np.sin(TURNS)]) for each in edges]
    low, high = (np.array([end(each, axis=0) for each in across]) for end in (np.min, np.max))
    # A follower lies midway between the cam's sides.
    moved = (low + high) / 2
    expected = follower_displacement(CAM, FOLLOWERS_MM[:, np.newaxis], TURNS)
    np.testing.assert_allclose(moved, expected, atol=0.02)
    amplitude = np.abs((moved * np.exp(-1j * TURNS)).mean(axis=1)) * 2
    np.testing.assert_allclose(amplitude, 3.5, atol=0.02)
    # The window is as wide as the cam, plus its play, whatever the angle.
    np.testing.assert_allclose(high - low, 18.0, atol=0.02)
    bore = edges[0][(np.linalg.norm(edges[0], axis=2) < 3.2).all(axis=1)].mean(axis=1)
    # The flat is where the bore comes nearest to the axis.
    x, y = min(bore, key=np.linalg.norm)
    assert abs(np.degrees(np.arctan2(y, x))) == pytest.approx(flat_deg, abs=1.0)


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


@pytest.mark.slow
def test_the_same_input_gives_the_same_bytes_in_another_process(made, tmp_path):
    output_of(*CAPSULE, "parts", "--out", tmp_path)
    ours = {path.relative_to(made): path.read_bytes() for path in made.rglob("*.*")}
    theirs = {path.relative_to(tmp_path): path.read_bytes() for path in tmp_path.rglob("*.*")}
    assert ours.keys() == theirs.keys()
    assert [name for name in ours if ours[name] != theirs[name]] == []
