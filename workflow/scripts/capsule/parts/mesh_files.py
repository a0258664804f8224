"""Make meshes as STL and 3MF; the same mesh always gives the same bytes."""

import io
import zipfile
from collections.abc import Sequence

import numpy as np

# A facet of binary STL: normal, three corners, two unused bytes.
_FACET = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("unused", "<u2")])
_HEADER_BYTES = 80
_EPOCH = (1980, 1, 1, 0, 0, 0)
_CORE = "http://schemas.microsoft.com/3dmanufacturing/core/2015/02"
_TYPES = (
    '<?xml version="1.0" encoding="UTF-8"?>\n'
    '<Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types">'
    '<Default Extension="rels" '
    'ContentType="application/vnd.openxmlformats-package.relationships+xml"/>'
    '<Default Extension="model" '
    'ContentType="application/vnd.ms-package.3dmanufacturing-3dmodel+xml"/></Types>\n'
)
_RELATIONS = (
    '<?xml version="1.0" encoding="UTF-8"?>\n'
    '<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships">'
    '<Relationship Target="/3D/3dmodel.model" Id="model" '
    'Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/></Relationships>\n'
)


def stl_bytes(name: str, vertices: np.ndarray, triangles: np.ndarray) -> bytes:
    """Return a mesh as binary STL, in mm.

    Parameters
    ----------
    name
        Name in the header.
    vertices, triangles
        The mesh, in the form of `capsule.parts.part.Part`.
    """
    corners = vertices[triangles]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    facets = np.zeros(len(triangles), _FACET)
    facets["normal"] = normal / np.linalg.norm(normal, axis=1, keepdims=True)
    facets["corners"] = corners
    header = f"{name}, mm".encode("ascii").ljust(_HEADER_BYTES)
    return header + np.uint32(len(triangles)).tobytes() + facets.tobytes()


def threemf_bytes(bodies: Sequence[tuple[str, np.ndarray, np.ndarray]]) -> bytes:
    """Return meshes as 3MF, in mm; each mesh is one object.

    Parameters
    ----------
    bodies
        Name, vertices and triangles of each mesh.
    """
    objects = [
        f'<object id="{number}" name="{name}" type="model"><mesh>\n<vertices>\n'
        + "".join(f'<vertex x="{x:.6f}" y="{y:.6f}" z="{z:.6f}"/>\n' for x, y, z in vertices)
        + "</vertices>\n<triangles>\n"
        + "".join(f'<triangle v1="{a}" v2="{b}" v3="{c}"/>\n' for a, b, c in triangles)
        + "</triangles>\n</mesh></object>\n"
        for number, (name, vertices, triangles) in enumerate(bodies, start=1)
    ]
    items = "".join(f'<item objectid="{number}"/>\n' for number in range(1, len(bodies) + 1))
    model = (
        f'<?xml version="1.0" encoding="UTF-8"?>\n<model unit="millimeter" xmlns="{_CORE}">\n'
        f"<resources>\n{''.join(objects)}</resources>\n<build>\n{items}</build>\n</model>\n"
    )
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w") as package:
        for path, text in (
            ("[Content_Types].xml", _TYPES),
            ("_rels/.rels", _RELATIONS),
            ("3D/3dmodel.model", model),
        ):
            # A fixed date and system: the bytes must depend only on the mesh.
            entry = zipfile.ZipInfo(path, _EPOCH)
            entry.create_system, entry.compress_type = 3, zipfile.ZIP_DEFLATED
            package.writestr(entry, text, compresslevel=6)
    return stream.getvalue()


def split_bodies(
    name: str, vertices: np.ndarray, triangles: np.ndarray
) -> list[tuple[str, np.ndarray, np.ndarray]]:
    """Return the separate bodies of a mesh with their names; the one at the head is first."""
    # The label of a body is the smallest number among its vertices.
    label = np.arange(len(vertices))
    while True:
        lowest = label[triangles].min(axis=1)
        spread = label.copy()
        for corner in range(3):
            np.minimum.at(spread, triangles[:, corner], lowest)
        if np.array_equal(spread, label):
            break
        label = spread[spread]
    bodies = []
    for body in np.unique(label[triangles[:, 0]]):
        chosen = triangles[label[triangles[:, 0]] == body]
        used, renumbered = np.unique(chosen, return_inverse=True)
        bodies.append((vertices[used], renumbered.reshape(-1, 3)))
    if len(bodies) == 1:
        return [(name, *bodies[0])]
    bodies.sort(key=lambda each: -each[0][:, 0].max())
    return [(f"{name} {number}", *body) for number, body in enumerate(bodies, start=1)]
