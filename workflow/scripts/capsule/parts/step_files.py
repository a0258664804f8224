"""Make parts as STEP files of the exact solids: planes, cylinders, and the cam's flank.

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
    BRepBuilderAPI_MakeWire,
)
from OCP.BRepOffsetAPI import BRepOffsetAPI_ThruSections
from OCP.BRepPrimAPI import BRepPrimAPI_MakePrism
from OCP.collections import List_TopoDS_Shape
from OCP.Convert import Convert_ParameterisationType
from OCP.GC import GC_MakeArcOfCircle
from OCP.Geom import Geom_Circle
from OCP.GeomConvert import GeomConvert
from OCP.gp import gp_Ax2, gp_Dir, gp_Pnt, gp_Trsf, gp_Vec
from OCP.IFSelect import IFSelect_ReturnStatus
from OCP.Interface import Interface_Static
from OCP.Message import Message, Message_Gravity
from OCP.ShapeUpgrade import ShapeUpgrade_UnifySameDomain
from OCP.StepBasic import StepBasic_Product
from OCP.STEPControl import STEPControl_StepModelType, STEPControl_Writer
from OCP.StepData import StepData_StepModel
from OCP.TCollection import TCollection_HAsciiString
from OCP.TopAbs import TopAbs_ShapeEnum
from OCP.TopExp import TopExp_Explorer
from OCP.TopLoc import TopLoc_Location
from OCP.TopoDS import TopoDS_Compound, TopoDS_Shape, TopoDS_Wire

from capsule.arrays import FloatArray
from capsule.parts.cam import Cam
from capsule.parts.outlines import Prism, Solid, middles, signed_area

# A fixed date: the bytes must depend only on the part.
_EPOCH = "1980-01-01T00:00:00"
# Sections through which the cam's flank passes: it deviates from the spiral by less than 1e-6 mm.
_SECTIONS = 33


def step_bytes(name: str, solid: Solid) -> bytes:
    """Return a solid as STEP (AP214), in mm, with a body for each of its copies.

    Raises
    ------
    RuntimeError
        Open CASCADE did not write the part.
    """
    builder, whole = BRep_Builder(), TopoDS_Compound()
    builder.MakeCompound(whole)
    for body in bodies(solid):
        builder.Add(whole, body)
    # Without this, Open CASCADE prints its progress between the lines of this program.
    for printer in Message.DefaultMessenger_s().Printers():
        printer.SetTraceLevel(Message_Gravity.Message_Fail)
    writer, stream = STEPControl_Writer(), io.BytesIO()
    # Only the seam of a flank needs curves in the parameters of its surface.
    curved = isinstance(solid.body, Cam)
    Interface_Static.SetIVal_s("write.surfacecurve.mode", int(curved))
    done = [writer.Transfer(whole, STEPControl_StepModelType.STEPControl_AsIs)]
    _set_names(writer.Model(), name)
    done.append(writer.WriteStream(stream))
    if done != [IFSelect_ReturnStatus.IFSelect_RetDone] * 2:
        raise RuntimeError(f"Open CASCADE did not write {name}: {done}")
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


def bodies(solid: Solid) -> Iterator[TopoDS_Shape]:
    """Yield each copy of a solid."""
    (whole,) = [_flank(solid.body)] if isinstance(solid.body, Cam) else _prisms(solid.body)
    if solid.cuts:
        cut, first, tools = BRepAlgoAPI_Cut(), List_TopoDS_Shape(), List_TopoDS_Shape()
        first.Append(whole)
        for tool in (each for prism in solid.cuts for each in _prisms(prism)):
            tools.Append(tool)
        cut.SetArguments(first)
        cut.SetTools(tools)
        cut.Build()
        whole = cut.Shape()
    # Faces that continue each other become one, such as the two halves of a cylinder.
    joined = ShapeUpgrade_UnifySameDomain(whole)
    joined.Build()
    body = TopExp_Explorer(joined.Shape(), TopAbs_ShapeEnum.TopAbs_SOLID).Current()
    for place in solid.places_mm:
        move = gp_Trsf()
        move.SetTranslation(gp_Vec(place, 0.0, 0.0))
        yield body.Moved(TopLoc_Location(move))


def _prisms(shape: Prism) -> list[TopoDS_Shape]:
    """Return the prism of each outline, with the holes that follow it."""
    faces: list[BRepBuilderAPI_MakeFace] = []
    for outline in shape.outlines:
        if signed_area(outline) > 0:
            faces.append(BRepBuilderAPI_MakeFace(_wire(outline, shape), True))
        else:
            faces[-1].Add(_wire(outline, shape))
    along = gp_Vec(*(_place(shape, 0.0, 0.0, shape.high_mm - shape.low_mm)))
    return [BRepPrimAPI_MakePrism(face.Face(), along).Shape() for face in faces]


def _place(shape: Prism, a: float, b: float, along: float) -> tuple[float, float, float]:
    """Return x, y and z of a point of a prism's area at a place along its axis."""
    return {"x": (along, a, b), "y": (a, along, b), "z": (a, b, along)}[shape.along]


def _wire(outline: FloatArray, shape: Prism) -> TopoDS_Wire:
    """Return the lines and arcs of an outline at the lower end of its prism."""
    wire = BRepBuilderAPI_MakeWire()
    corners = [gp_Pnt(*_place(shape, x, y, shape.low_mm)) for x, y in outline[:, :2].tolist()]
    between = [gp_Pnt(*_place(shape, x, y, shape.low_mm)) for x, y in middles(outline).tolist()]
    for bulge, start, middle, end in zip(
        outline[:, 2].tolist(), corners, between, corners[1:] + corners[:1], strict=True
    ):
        curved = (GC_MakeArcOfCircle(start, middle, end).Value(),) if bulge else (start, end)
        wire.Add(BRepBuilderAPI_MakeEdge(*curved).Edge())
    return wire.Wire()


def _flank(cam: Cam) -> TopoDS_Shape:
    """Return the solid of a circle moved along a helix."""
    axes = gp_Ax2(gp_Pnt(0.0, 0.0, 0.0), gp_Dir(0.0, 0.0, 1.0))
    # An exact circle in one smooth piece.
    circle = GeomConvert.CurveToBSplineCurve_s(
        Geom_Circle(axes, cam.radius_mm), Convert_ParameterisationType.Convert_QuasiAngular
    )
    flank = BRepOffsetAPI_ThruSections(True)
    for turn in np.linspace(0.0, 1.0, _SECTIONS).tolist():
        angle = 2 * np.pi * turn
        # The circle's angle lags upwards, because the wave travels along the shaft.
        x, y = cam.eccentricity_mm * np.array([np.cos(angle), -np.sin(angle)])
        edge = BRepBuilderAPI_MakeEdge(circle.Translated(gp_Vec(x, y, cam.lead_mm * turn)))
        flank.AddWire(BRepBuilderAPI_MakeWire(edge.Edge()).Wire())
    # The sections already begin at the same angle.
    flank.CheckCompatibility(False)
    flank.Build()
    return flank.Shape()
