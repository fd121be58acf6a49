# SPDX-License-Identifier: GPL-3.0-or-later
"""A mesh that carries all that Blender's meshes can carry, and what it carries, for tests of fidelity."""

import bpy
import numpy as np
import shapes

# type -> (key of foreach_get, numbers per element, numpy type)
KINDS = {
    "FLOAT": ("value", 1, np.float32),
    "INT": ("value", 1, np.int32),
    "INT8": ("value", 1, np.int8),
    "BOOLEAN": ("value", 1, bool),
    "FLOAT_VECTOR": ("vector", 3, np.float32),
    "FLOAT2": ("vector", 2, np.float32),
    "FLOAT_COLOR": ("color", 4, np.float32),
    "BYTE_COLOR": ("color", 4, np.float32),
    "INT32_2D": ("value", 2, np.int32),
    "INT16_2D": ("value", 2, np.int16),
}


def values(attribute):
    key, width, kind = KINDS[attribute.data_type]
    found = np.empty(len(attribute.data) * width, kind)
    attribute.data.foreach_get(key, found)
    return found.reshape(-1, width) if width > 1 else found


def set_values(attribute, new):
    key, _, kind = KINDS[attribute.data_type]
    attribute.data.foreach_set(key, np.ascontiguousarray(new, kind).ravel())


def attributes(ob):
    """{name: (domain, type, bytes)} of everything but selections, in object mode."""
    return {
        a.name: (a.domain, a.data_type, values(a).tobytes())
        for a in ob.data.attributes
        if a.data_type in KINDS and "select" not in a.name
    }


def places(mesh, domain):
    """(k, 3) where each element of a domain lies."""
    points = np.array([v.co for v in mesh.vertices])
    if domain == "POINT":
        return points
    if domain == "CORNER":
        return points[[loop.vertex_index for loop in mesh.loops]]
    if domain == "EDGE":
        return np.array([points[list(e.vertices)].mean(axis=0) for e in mesh.edges])
    return np.array([points[list(p.vertices)].mean(axis=0) for p in mesh.polygons])


def linear(at):
    """A value that interpolation of any kind has to meet."""
    return 0.4 + 0.2 * at[:, 0] + 0.1 * at[:, 1]


def add_attributes(ob):
    """Of each type: linear on vertices and corners, by element on edges and faces."""
    mesh = ob.data
    for domain in ("POINT", "CORNER"):
        at = linear(places(mesh, domain))
        for kind in ("FLOAT", "FLOAT_VECTOR", "FLOAT_COLOR", "BYTE_COLOR", "FLOAT2"):
            if kind == "FLOAT2" and domain == "CORNER":
                continue  # another UV map
            attribute = mesh.attributes.new(f"{domain} {kind}", kind, domain)
            width = KINDS[kind][1]
            set_values(attribute, np.repeat(at[:, None], width, axis=1))
    for domain in ("EDGE", "FACE"):
        count = len(mesh.edges) if domain == "EDGE" else len(mesh.polygons)
        number = np.arange(count)
        for kind in ("FLOAT", "INT", "INT8", "BOOLEAN", "FLOAT_VECTOR", "FLOAT_COLOR"):
            attribute = mesh.attributes.new(f"{domain} {kind}", kind, domain)
            width = KINDS[kind][1]
            new = number % 2 == 0 if kind == "BOOLEAN" else number / (count if "C" in kind else 1)
            set_values(attribute, np.repeat(new[:, None], width, axis=1))


def mesh(n=2):
    """An n x n sheet with all of it, selected and active."""
    ob = shapes.grid(n, bump=0.0, uv=True)
    data = ob.data
    add_attributes(ob)
    group = ob.vertex_groups.new(name="Weight")
    for v, weight in enumerate(linear(places(data, "POINT")).tolist()):
        group.add([v], weight, "REPLACE")
    other = data.uv_layers.new(name="Other", do_init=False)
    set_values(data.attributes["Other"], places(data, "CORNER")[:, :2])
    data.uv_layers.active = data.uv_layers["UVMap"]
    assert other is not None
    for name in ("A", "B"):
        data.materials.append(bpy.data.materials.new(name))
    data.polygons[0].material_index = 1
    data.polygons[0].use_smooth = True
    number = np.arange(len(data.edges)) / len(data.edges)
    for name in ("crease_edge", "bevel_weight_edge"):
        set_values(data.attributes.new(name, "FLOAT", "EDGE"), number)
    for name in ("crease_vert", "bevel_weight_vert"):
        set_values(data.attributes.new(name, "FLOAT", "POINT"), linear(places(data, "POINT")))
    for edge in list(data.edges)[::2]:
        edge.use_seam = edge.use_edge_sharp = True
    ob.shape_key_add(name="Basis")
    key = ob.shape_key_add(name="Up")
    for point in key.data:
        point.co.z += 1.0 + point.co.x
    return ob
