"""Open CASCADE reads the STEP files, and they fit the meshes of the same run.

These tests run only if the extra `cad` is installed (conftest.py).
"""

import numpy as np
import pytest
import trimesh
from OCP.Bnd import Bnd_Box
from OCP.BRep import BRep_Tool
from OCP.BRepAdaptor import BRepAdaptor_Surface
from OCP.BRepBndLib import BRepBndLib
from OCP.BRepCheck import BRepCheck_Analyzer
from OCP.BRepGProp import BRepGProp
from OCP.GeomAbs import GeomAbs_SurfaceType
from OCP.GProp import GProp_GProps
from OCP.IFSelect import IFSelect_ReturnStatus
from OCP.STEPControl import STEPControl_Reader
from OCP.TopAbs import TopAbs_ShapeEnum
from OCP.TopExp import TopExp_Explorer
from OCP.TopoDS import TopoDS

from capsule.parts.all_parts import substructure
from capsule.parts.files import read_design
from capsule.parts.step_files import step_bytes
from support.command import run_command

pytestmark = pytest.mark.cad
CAM = read_design().cam
PLANE = GeomAbs_SurfaceType.GeomAbs_Plane
CYLINDER = GeomAbs_SurfaceType.GeomAbs_Cylinder


def pieces(shape, kind):
    """Return the parts of a shape that have a kind; a part shared by two faces comes twice."""
    explorer = TopExp_Explorer(shape, getattr(TopAbs_ShapeEnum, f"TopAbs_{kind}"))
    while explorer.More():
        yield explorer.Current()
        explorer.Next()


def surfaces(shape):
    return [BRepAdaptor_Surface(TopoDS.Face(face)) for face in pieces(shape, "FACE")]


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    run_command("parts", "--step", "--out", folder := tmp_path_factory.mktemp("parts"))
    return folder


@pytest.fixture(scope="module")
def shapes(made):
    read = {}
    for path in made.glob("*.step"):
        reader = STEPControl_Reader()
        assert reader.ReadFile(str(path)) == IFSelect_ReturnStatus.IFSelect_RetDone
        assert reader.TransferRoots() == 1
        read[path.stem] = reader.OneShape()
    return read


def test_every_part_is_one_valid_solid_and_the_assembly_four(made, shapes, listed):
    """Their volumes and boxes are those of the meshes."""
    assert shapes.keys() == listed["parts"].keys()
    for name, shape in shapes.items():
        part, solids = listed["parts"][name], list(pieces(shape, "SOLID"))
        assert len(solids) == part["bodies"] == (4 if name == "assembly" else 1), name
        for solid in solids:
            assert BRepCheck_Analyzer(solid).IsValid(), name
            (shell,) = pieces(solid, "SHELL")
            assert BRep_Tool.IsClosed_s(shell), name
        properties, bounds = GProp_GProps(), Bnd_Box()
        BRepGProp.VolumeProperties_s(shape, properties, 1e-6)
        # A volume that faces inwards would be negative.
        assert properties.Mass() == pytest.approx(part["volume_mm3"], rel=1e-3), name
        BRepBndLib.AddOptimal_s(shape, bounds, False, False)
        box = [[each.X(), each.Y(), each.Z()] for each in (bounds.CornerMin(), bounds.CornerMax())]
        np.testing.assert_allclose(box, trimesh.load_mesh(made / f"{name}.stl").bounds, atol=0.01)


# An outline of short lines would have none. Bulbs; bearings and the ends of three slots; a disc
# and its bore.
CYLINDERS = {"substructure": 2, "assembly": 8, "coupon-awn": 1, "end-plate": 8}
CYLINDERS |= {"coupon-fit-cam": 2, "cam-left": 1, "cam-right": 1}


def test_every_round_is_a_cylinder_in_one_piece(shapes):
    for name, shape in shapes.items():
        kinds = [each.GetType() for each in surfaces(shape)]
        assert kinds.count(CYLINDER) == CYLINDERS.get(name, 0), name
        other = [kind for kind in kinds if kind not in (PLANE, CYLINDER)]
        assert len(other) == name.startswith("cam-"), name
    # Four sides without, two ends, and in the window a bevel to either side of a ridge, two flat.
    assert len(surfaces(shapes["follower"])) == 4 + 2 + 4 + 2


@pytest.mark.parametrize("side", ["left", "right"])
def test_the_cams_flank_is_the_spiral(shapes, side):
    kinds = (PLANE, CYLINDER)
    (flank,) = [each for each in surfaces(shapes[f"cam-{side}"]) if each.GetType() not in kinds]
    around = np.linspace(flank.FirstUParameter(), flank.LastUParameter(), 101)
    upwards = np.linspace(flank.FirstVParameter(), flank.LastVParameter(), 101)
    points = [flank.Value(u, v) for u in around for v in upwards]
    x, y, z = np.array([[point.X(), point.Y(), point.Z()] for point in points]).T
    centre = CAM.eccentricity_mm * np.exp(-2j * np.pi * z / CAM.lead_mm)
    np.testing.assert_allclose(np.abs(x + 1j * y - centre), CAM.radius_mm, atol=1e-6)
    assert (z.min(), z.max()) == pytest.approx((0.0, CAM.lead_mm), abs=1e-6)


def test_a_file_holds_neither_a_time_nor_a_count_of_what_was_written_before(made, listed):
    for name in listed["parts"]:
        content, part = (made / f"{name}.step").read_bytes(), name.encode()
        assert b"FILE_NAME('%b','1980-01-01T00:00:00'" % part in content
        assert b"= PRODUCT('%b','%b',''" % (part, part) in content
    unit = substructure(read_design())
    for _ in range(2):
        assert step_bytes(unit.name, unit.solid) == (made / "substructure.step").read_bytes()
