"""Make the printable parts, and measure their files without the code that wrote them."""

import re
import struct
import zipfile
from xml.etree import ElementTree

import numpy as np
import trimesh

from support.command import run_command

_MODEL = "{http://schemas.microsoft.com/3dmanufacturing/core/2015/02}"


def make_into(folder, *options):
    """Make all parts in this process, and return the folder."""
    run_command("parts", "--out", folder, *options)
    return folder


def read_stl(path):
    """Return the triangles of a binary STL, shape (T, 3, 3), and its normals."""
    content = path.read_bytes()
    (count,) = struct.unpack_from("<I", content, 80)
    assert len(content) == 84 + 50 * count
    facet = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("unused", "<u2")])
    facets = np.frombuffer(content, facet, offset=84)
    return facets["corners"].astype(float), facets["normal"].astype(float)


def read_3mf(path):
    """Return name, vertices in mm, and triangles of each object of a 3MF."""
    with zipfile.ZipFile(path) as package:
        model = ElementTree.fromstring(package.read("3D/3dmodel.model"))
    assert model.get("unit") == "millimeter"
    built = [item.get("objectid") for item in model.iter(f"{_MODEL}item")]
    bodies = []
    for body in model.iter(f"{_MODEL}object"):
        assert body.get("id") in built
        vertices = [[float(v.get(a)) for a in "xyz"] for v in body.iter(f"{_MODEL}vertex")]
        triangles = [
            [int(t.get(a)) for a in ("v1", "v2", "v3")] for t in body.iter(f"{_MODEL}triangle")
        ]
        bodies.append((body.get("name"), np.array(vertices), np.array(triangles)))
    return bodies


def read_svg(path):
    """Return the outlines of an SVG by layer as polygons, in mm, with y upwards."""
    root = ElementTree.fromstring(path.read_text(encoding="utf-8"))
    width, height = (float(root.get(name).removesuffix("mm")) for name in ("width", "height"))
    # One unit of the picture is one millimetre.
    assert [float(each) for each in root.get("viewBox").split()] == [0, 0, width, height]
    layers = {}
    for group in root.iter("{http://www.w3.org/2000/svg}g"):
        (path_element,) = group
        closed = [part for part in path_element.get("d").split("Z") if part.strip()]
        layers[group.get("id")] = [_flattened(part) * [1, -1] + [0, height] for part in closed]
    return layers


def _flattened(data):
    """Return the corners of a path's lines, and points on its arcs."""
    points = []
    for kind, words in re.findall(r"([MLA])([^MLA]*)", data):
        *arc, end = words.split()
        end = complex(*map(float, end.split(",")))
        if kind == "A" and end != points[-1]:
            radius, large, sweep = float(arc[0]), arc[3] == "1", arc[4] == "1"
            half = np.arcsin(min(abs(end - points[-1]) / 2 / radius, 1.0))
            turn = (2 * np.pi - 2 * half if large else 2 * half) * (1 if sweep else -1)
            # The centre, around which the start turns to the end.
            centre = (end - points[-1] * np.exp(1j * turn)) / (1 - np.exp(1j * turn))
            steps = np.exp(1j * turn * np.arange(1, 64) / 64)
            points += list(centre + (points[-1] - centre) * steps)
        points.append(end)
    # The last point closes the path.
    points = np.array(points[:-1] if points[0] == points[-1] else points)
    return np.column_stack([points.real, points.imag])


def edges_of(outlines):
    """Return the edges of closed outlines, shape (N, 2, 2)."""
    return np.vstack([np.stack([each, np.roll(each, -1, axis=0)], axis=1) for each in outlines])


def section(triangles, height):
    """Return the edges of a mesh's section at a height, shape (N, 2, 2)."""
    mesh = trimesh.Trimesh(**trimesh.triangles.to_kwargs(triangles), process=False)
    return trimesh.intersections.mesh_plane(mesh, [0, 0, 1], [0, 0, height])[:, :, :2]


def clearance(points, edges):
    """Return the distance of each point, of shape (..., 2), from the nearest edge."""
    start, way = edges[:, 0], edges[:, 1] - edges[:, 0]
    from_start = points[..., np.newaxis, :] - start
    part = (from_start * way).sum(axis=-1) / (way**2).sum(axis=-1)
    beside = from_start - part.clip(0, 1)[..., np.newaxis] * way
    return np.linalg.norm(beside, axis=-1).min(axis=-1)
