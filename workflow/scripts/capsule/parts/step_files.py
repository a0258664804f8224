"""Make parts as STEP files with exact faces, not with the triangles of a mesh.

This is the only module that needs Open CASCADE (OCP). `capsule parts` imports it only for
``--step``.
"""

import io
from collections.abc import Iterator

import numpy as np
from OCP.APIHeaderSection import APIHeaderSection_MakeHeader
from OCP.BRep import BRep_Builder
from OCP.BRepAlgoAPI import BRepAlgoAPI_Cut
from OCP.BRepBuilderAPI import (
    BRepBuilderAPI_MakeEdge,
    BRepBuilderAPI_MakeFace,
    BRepBuilderAPI_MakePolygon,
    BRepBuilderAPI_MakeShapeOnMesh,
    BRepBuilderAPI_MakeWire,
)
from OCP.BRepOffsetAPI import BRepOffsetAPI_ThruSections
from OCP.BRepPrimAPI import BRepPrimAPI_MakePrism
from OCP.Convert import Convert_ParameterisationType
from OCP.Geom import Geom_Circle
from OCP.GeomConvert import GeomConvert
from OCP.gp import gp_Ax2, gp_Dir, gp_Pnt, gp_Vec
from OCP.IFSelect import IFSelect_ReturnStatus
from OCP.Interface import Interface_Static
from OCP.Message import Message, Message_Gravity
from OCP.Poly import Poly_Triangle, Poly_Triangulation
from OCP.ShapeUpgrade import ShapeUpgrade_UnifySameDomain
from OCP.StepBasic import StepBasic_Product
from OCP.STEPControl import STEPControl_StepModelType, STEPControl_Writer
from OCP.StepData import StepData_StepModel
from OCP.TCollection import TCollection_HAsciiString
from OCP.TopAbs import TopAbs_ShapeEnum
from OCP.TopExp import TopExp_Explorer
from OCP.TopoDS import TopoDS_Compound, TopoDS_Shape, TopoDS_Shell, TopoDS_Solid

from capsule.arrays import FloatArray, IntArray
from capsule.parts.design import Part, Spiral
from capsule.parts.formats import split_bodies

# A fixed date: the bytes must depend only on the part.
_EPOCH = "1980-01-01T00:00:00"
# Sections through which the cam's flank passes: it deviates from the spiral by less than 1e-6 mm.
_SECTIONS = 33


def step_bytes(part: Part) -> bytes:
    """Return a part as STEP (AP214), in mm, with a solid for each of its bodies.

    A mesh of plane faces becomes exactly these faces. A cam becomes its spiral, to 1e-6 mm.

    Raises
    ------
    RuntimeError
        Open CASCADE did not write the part.
    """
    builder, whole = BRep_Builder(), TopoDS_Compound()
    builder.MakeCompound(whole)
    if part.spiral is not None:
        builder.Add(whole, _spiral_solid(part.spiral))
    else:
        for _, vertices, triangles in split_bodies(part.name, part.vertices, part.triangles):
            builder.Add(whole, _plane_solid(vertices, triangles))
    # Without this, Open CASCADE prints its progress between the lines of this program.
    for printer in Message.DefaultMessenger_s().Printers():
        printer.SetTraceLevel(Message_Gravity.Message_Fail)
    writer, stream = STEPControl_Writer(), io.BytesIO()
    # Only the seam of a flank needs curves in the parameters of its surface; a plane does not.
    Interface_Static.SetIVal_s("write.surfacecurve.mode", int(part.spiral is not None))
    done = [writer.Transfer(whole, STEPControl_StepModelType.STEPControl_AsIs)]
    _set_names(writer.Model(), part.name)
    done.append(writer.WriteStream(stream))
    if done != [IFSelect_ReturnStatus.IFSelect_RetDone] * 2:
        raise RuntimeError(f"Open CASCADE did not write {part.name}: {done}")
    return stream.getvalue()


def _set_names(model: StepData_StepModel, name: str) -> None:
    """Set the names of a file and of its product, without a number and with a fixed date."""
    text = TCollection_HAsciiString(name)
    header = APIHeaderSection_MakeHeader(model)
    header.SetName(text)
    header.SetTimeStamp(TCollection_HAsciiString(_EPOCH))
    header.Apply(model)
    for number in range(1, model.NbEntities() + 1):
        entity = model.Value(number)
        if isinstance(entity, StepBasic_Product):
            entity.SetId(text)
            entity.SetName(text)


def _pieces(shape: TopoDS_Shape, kind: TopAbs_ShapeEnum) -> Iterator[TopoDS_Shape]:
    explorer = TopExp_Explorer(shape, kind)
    while explorer.More():
        yield explorer.Current()
        explorer.Next()


def _plane_solid(vertices: FloatArray, triangles: IntArray) -> TopoDS_Solid:
    """Return the solid within a closed mesh; triangles in one plane become one face."""
    mesh = Poly_Triangulation(len(vertices), len(triangles), False, False)
    for number, point in enumerate(vertices.tolist(), start=1):
        mesh.SetNode(number, gp_Pnt(*point))
    for number, corners in enumerate((triangles + 1).tolist(), start=1):
        mesh.SetTriangle(number, Poly_Triangle(*corners))
    facets = BRepBuilderAPI_MakeShapeOnMesh(mesh)
    facets.Build()
    joined = ShapeUpgrade_UnifySameDomain(facets.Shape())
    joined.Build()
    builder, shell, solid = BRep_Builder(), TopoDS_Shell(), TopoDS_Solid()
    builder.MakeShell(shell)
    for face in _pieces(joined.Shape(), TopAbs_ShapeEnum.TopAbs_FACE):
        builder.Add(shell, face)
    shell.Closed(True)
    builder.MakeSolid(solid)
    builder.Add(solid, shell)
    return solid


def _spiral_solid(spiral: Spiral) -> TopoDS_Shape:
    """Return a cam's section: its circle, moved along a helix, less the bore."""
    cam = spiral.cam
    axes = gp_Ax2(gp_Pnt(0.0, 0.0, 0.0), gp_Dir(0.0, 0.0, 1.0))
    # An exact circle in one smooth piece.
    circle = GeomConvert.CurveToBSplineCurve_s(
        Geom_Circle(axes, cam.radius_mm), Convert_ParameterisationType.Convert_QuasiAngular
    )
    flank = BRepOffsetAPI_ThruSections(True)
    for turn in np.linspace(0.0, 1.0, _SECTIONS).tolist():
        # The circle's angle lags upwards, because the wave travels along the shaft.
        x, y = cam.eccentricity_mm * np.array([np.cos(2 * np.pi * turn), -np.sin(2 * np.pi * turn)])
        edge = BRepBuilderAPI_MakeEdge(circle.Translated(gp_Vec(x, y, cam.lead_mm * turn)))
        flank.AddWire(BRepBuilderAPI_MakeWire(edge.Edge()).Wire())
    # The sections already begin at the same angle.
    flank.CheckCompatibility(False)
    flank.Build()
    ring = BRepBuilderAPI_MakePolygon()
    for x, y in spiral.bore.tolist():
        ring.Add(gp_Pnt(x, y, 0.0))
    ring.Close()
    through = gp_Vec(0.0, 0.0, cam.lead_mm)
    bore = BRepPrimAPI_MakePrism(BRepBuilderAPI_MakeFace(ring.Wire()).Face(), through)
    cut = BRepAlgoAPI_Cut(flank.Shape(), bore.Shape())
    return next(_pieces(cut.Shape(), TopAbs_ShapeEnum.TopAbs_SOLID))
