"""Evaluated meshes to binary PLY: one file a mesh and material slot."""

import os

import numpy as np


def _foreach(collection, attribute, count, dtype):
    values = np.empty(count, dtype=dtype)
    collection.foreach_get(attribute, values)
    return values


def _corner_normals(mesh, count):
    if hasattr(mesh, "corner_normals"):  # 4.1 and later
        return _foreach(mesh.corner_normals, "vector", 3 * count, np.float32)
    mesh.calc_normals_split()
    return _foreach(mesh.loops, "normal", 3 * count, np.float32)


def _corners(mesh):
    """Positions, normals and texture coordinates of face corners, which keep sharp edges and
    seams apart; the second value tells whether there are texture coordinates."""
    count = len(mesh.loops)
    vertices = _foreach(mesh.vertices, "co", 3 * len(mesh.vertices), np.float32).reshape(-1, 3)
    corner_vertex = _foreach(mesh.loops, "vertex_index", count, np.int32)
    fields = [vertices[corner_vertex], _corner_normals(mesh, count).reshape(-1, 3)]
    layer = mesh.uv_layers.active
    if layer is not None:
        fields.append(_foreach(layer.data, "uv", 2 * count, np.float32).reshape(-1, 2))
    return np.hstack(fields).astype("<f4"), layer is not None


def write_ply(path, corners, with_uv, triangles):
    used, triangles = np.unique(triangles, return_inverse=True)
    triangles = triangles.reshape(-1, 3)
    names = ["x", "y", "z", "nx", "ny", "nz"] + (["u", "v"] if with_uv else [])
    header = "ply\nformat binary_little_endian 1.0\nelement vertex %d\n" % len(used)
    header += "".join("property float %s\n" % name for name in names)
    header += "element face %d\nproperty list uchar int vertex_indices\nend_header\n" % len(triangles)
    faces = np.empty(len(triangles), dtype=[("n", "u1"), ("v", "<i4", 3)])
    faces["n"] = 3
    faces["v"] = triangles
    with open(path, "wb") as file:
        file.write(header.encode("ascii"))
        file.write(corners[used].tobytes())
        file.write(faces.tobytes())


def export(mesh, folder, stem):
    """Writes the triangles of each material slot. Returns [(file, slot, has_uv)], without
    slots that have none."""
    mesh.calc_loop_triangles()
    count = len(mesh.loop_triangles)
    if count == 0:
        return []
    triangles = _foreach(mesh.loop_triangles, "loops", 3 * count, np.int32).reshape(-1, 3)
    slots = _foreach(mesh.loop_triangles, "material_index", count, np.int32)
    corners, with_uv = _corners(mesh)
    written = []
    for slot in np.unique(slots):
        name = "%s_%d.ply" % (stem, slot)
        write_ply(os.path.join(folder, name), corners, with_uv, triangles[slots == slot])
        written.append((name, int(slot), with_uv))
    return written
