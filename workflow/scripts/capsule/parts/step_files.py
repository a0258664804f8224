"""Make parts as STEP files with exact faces, not with the triangles of a mesh.

This is the only module that needs Open CASCADE (OCP). `capsule parts` imports it only for
``--step``.
"""

import io
from collections.abc import Sequence

import numpy as np
from OCP.APIHeaderSection import APIHeaderSection_MakeHeader
from OCP.BRep import BRep_Builder, BRep_Tool
from OCP.BRepBuilderAPI import (
    BRepBuilderAPI_MakeEdge,
    BRepBuilderAPI_MakeFace,
    BRepBuilderAPI_MakeVertex,
)
from OCP.collections import Array1_double, Array1_int, Array2_gp_Pnt
from OCP.Geom import Geom_BSplineSurface, Geom_Plane
from OCP.gp import gp_Dir, gp_Pln, gp_Pnt
from OCP.IFSelect import IFSelect_ReturnStatus
from OCP.Interface import Interface_Static
from OCP.Message import Message, Message_Gravity
from OCP.StepBasic import StepBasic_Product
from OCP.STEPControl import STEPControl_StepModelType, STEPControl_Writer
from OCP.StepData import StepData_StepModel
from OCP.TCollection import TCollection_HAsciiString
from OCP.TopAbs import TopAbs_ShapeEnum
from OCP.TopExp import TopExp_Explorer
from OCP.TopoDS import (
    TopoDS,
    TopoDS_Compound,
    TopoDS_Edge,
    TopoDS_Face,
    TopoDS_Shape,
    TopoDS_Shell,
    TopoDS_Solid,
    TopoDS_Wire,
)

from capsule.arrays import IntArray
from capsule.parts.design import Part, Spiral
from capsule.parts.exact_faces import DEGREE, cam_surface, plane_faces
from capsule.parts.formats import split_bodies

# A fixed date: the bytes must depend only on the part.
_EPOCH = "1980-01-01T00:00:00"
_TOLERANCE_MM = 1e-6
_UP, _DOWN = np.array([0.0, 0.0, 1.0]), np.array([0.0, 0.0, -1.0])


def step_bytes(part: Part) -> bytes:
    """Return a part as STEP (AP214), in mm, with a solid for each of its bodies.

    A mesh of plane faces becomes exactly these faces. A cam becomes its spiral, to 1e-4 mm.

    Raises
    ------
    RuntimeError
        Open CASCADE did not write the part.
    """
    if part.spiral is not None:
        solids = [_spiral_solid(part.spiral)]
    else:
        bodies = split_bodies(part.name, part.vertices, part.triangles)
        solids = [_plane_solid(vertices, triangles) for _, vertices, triangles in bodies]
    # Without this, Open CASCADE prints its progress between the lines of this program.
    for printer in Message.DefaultMessenger_s().Printers():
        printer.SetTraceLevel(Message_Gravity.Message_Fail)
    writer, stream = STEPControl_Writer(), io.BytesIO()
    # Only the seam of a flank needs curves in the parameters of its surface; a plane does not.
    Interface_Static.SetIVal_s("write.surfacecurve.mode", int(part.spiral is not None))
    done = [writer.Transfer(_one_shape(solids), STEPControl_StepModelType.STEPControl_AsIs)]
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


def _one_shape(solids: Sequence[TopoDS_Solid]) -> TopoDS_Shape:
    if len(solids) == 1:
        return solids[0]
    together = TopoDS_Compound()
    BRep_Builder().MakeCompound(together)
    for solid in solids:
        BRep_Builder().Add(together, solid)
    return together


# Numbers of the corners of a loop.
Corners = Sequence[int] | IntArray


class _Shell:
    """A shell: the faces of a solid, which share their edges and corners.

    Parameters
    ----------
    vertices
        Shape (V, 3), in mm.
    """

    def __init__(self, vertices: np.ndarray) -> None:
        self._builder = BRep_Builder()
        self._points = [gp_Pnt(*map(float, point)) for point in vertices]
        self._corners = [BRepBuilderAPI_MakeVertex(point).Vertex() for point in self._points]
        self._edges: dict[tuple[int, int], TopoDS_Edge] = {}
        self._shell = TopoDS_Shell()
        self._builder.MakeShell(self._shell)

    def edge(self, start: int, end: int) -> TopoDS_Shape:
        """Return the straight edge between two corners; both directions share one edge."""
        if (end, start) in self._edges:
            return self._edges[end, start].Reversed()
        if (start, end) not in self._edges:
            made = BRepBuilderAPI_MakeEdge(self._corners[start], self._corners[end])
            self._edges[start, end] = made.Edge()
        return self._edges[start, end]

    def loop(self, corners: Corners) -> list[TopoDS_Shape]:
        """Return the edges around some corners."""
        ends = [*corners[1:], corners[0]]
        return [self.edge(int(a), int(b)) for a, b in zip(corners, ends, strict=True)]

    def add_plane(
        self, normal: np.ndarray, origin: gp_Pnt, loops: Sequence[Sequence[TopoDS_Shape]]
    ) -> None:
        """Add a plane face with its outline and its holes.

        Parameters
        ----------
        normal
            Normal of the plane, outward.
        origin
            A point of the plane.
        loops
            The edges of each boundary, with the solid to their left.
        """
        face = TopoDS_Face()
        plane = gp_Pln(origin, gp_Dir(*map(float, normal)))
        self._builder.MakeFace(face, Geom_Plane(plane), _TOLERANCE_MM)
        for loop in loops:
            wire = TopoDS_Wire()
            self._builder.MakeWire(wire)
            for edge in loop:
                self._builder.Add(wire, edge)
            wire.Closed(True)
            self._builder.Add(face, wire)
        self.add(face)

    def add_polygon(self, normal: np.ndarray, loops: Sequence[Corners]) -> None:
        """Add a plane face between straight edges, by the numbers of its corners."""
        edges = [self.loop(corners) for corners in loops]
        self.add_plane(normal, self._points[loops[0][0]], edges)

    def add(self, face: TopoDS_Face) -> None:
        """Add a face whose outward side is set."""
        self._builder.Add(self._shell, face)

    def solid(self) -> TopoDS_Solid:
        """Return the solid that the faces enclose."""
        self._shell.Closed(True)
        solid = TopoDS_Solid()
        self._builder.MakeSolid(solid)
        self._builder.Add(solid, self._shell)
        return solid


def _plane_solid(vertices: np.ndarray, triangles: np.ndarray) -> TopoDS_Solid:
    """Return the solid within a mesh; triangles in one plane become one face."""
    shell = _Shell(vertices)
    for face in plane_faces(vertices, triangles):
        shell.add_polygon(face.normal, face.loops)
    return shell.solid()


def _spiral_solid(spiral: Spiral) -> TopoDS_Solid:
    """Return a cam's section: its flank, two ends, and the faces of the bore."""
    lead, count = spiral.cam.lead_mm, len(spiral.bore)
    rings = [np.column_stack([spiral.bore, np.full(count, level)]) for level in (0.0, lead)]
    shell = _Shell(np.vstack(rings))
    flank = BRepBuilderAPI_MakeFace(_flank(spiral), _TOLERANCE_MM).Face()
    shell.add(flank)
    low, high = _rims(flank, lead)
    ring = np.arange(count)
    shell.add_plane(_DOWN, gp_Pnt(0.0, 0.0, 0.0), [[low.Reversed()], shell.loop(ring)])
    upper = shell.loop(count + ring[::-1])
    shell.add_plane(_UP, gp_Pnt(0.0, 0.0, lead), [[high.Reversed()], upper])
    for this in ring:
        # The corners of the bore run anticlockwise, so the solid lies to the right of each edge.
        other = (this + 1) % count
        x, y = spiral.bore[other] - spiral.bore[this]
        inwards = np.array([-y, x, 0.0])
        shell.add_polygon(inwards, [np.array([other, this, count + this, count + other])])
    return shell.solid()


def _flank(spiral: Spiral) -> Geom_BSplineSurface:
    repeated, poles = cam_surface(spiral.cam)
    knots, times = np.unique(repeated, return_counts=True)
    grid = Array2_gp_Pnt(1, len(poles), 1, len(poles))
    for (row, column), _ in np.ndenumerate(poles[..., 0]):
        grid.SetValue(row + 1, column + 1, gp_Pnt(*map(float, poles[row, column])))
    at, multiple = Array1_double(1, len(knots)), Array1_int(1, len(knots))
    for number, (knot, count) in enumerate(zip(knots, times, strict=True), start=1):
        at.SetValue(number, float(knot))
        multiple.SetValue(number, int(count))
    return Geom_BSplineSurface(grid, at, at, multiple, multiple, DEGREE, DEGREE)


def _rims(flank: TopoDS_Face, lead_mm: float) -> tuple[TopoDS_Edge, TopoDS_Edge]:
    """Return the lower and the upper rim of a flank, in the flank's direction."""
    rims: list[TopoDS_Edge | None] = [None, None]
    edges = TopExp_Explorer(flank, TopAbs_ShapeEnum.TopAbs_EDGE)
    while edges.More():
        edge = TopoDS.Edge(edges.Current())
        if not BRep_Tool.IsClosed_s(edge, flank):
            corner = TopExp_Explorer(edge, TopAbs_ShapeEnum.TopAbs_VERTEX).Current()
            level = BRep_Tool.Pnt_s(TopoDS.Vertex(corner)).Z()
            rims[int(level > lead_mm / 2)] = edge
        edges.Next()
    low, high = rims
    if low is None or high is None:
        raise RuntimeError("the cam's flank has no rim at an end")
    return low, high
