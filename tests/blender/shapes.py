# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes for the tests, made from nothing, and looks at what is stored in them."""

import os
import re
import subprocess
import sys
from pathlib import Path

import bmesh
import bpy
import numpy as np

TESTS = Path(__file__).resolve().parent.parent
sys.path.append(str(TESTS))
from judges.exact import flips  # noqa: E402


def add(name, vertices, faces, *, uv=False, edges=()):
    """A new selected and active mesh object."""
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(
        [tuple(map(float, v)) for v in vertices], list(edges), [tuple(f) for f in faces]
    )
    if uv:
        mesh.uv_layers.new(name="UVMap")
    ob = bpy.data.objects.new(name, mesh)
    bpy.context.scene.collection.objects.link(ob)
    activate(ob)
    return ob


def command(*arguments):
    """A Blender of its own that runs this extension's command line; with the package bpy a Python."""
    if bpy.app.binary_path:
        program = [os.environ["FLIPFREE_BLENDER"], "-b", "-c", "flipfree"]
    else:
        program = [sys.executable, str(TESTS.parent / "scripts/farm/flipfree_bpy.py")]
    return subprocess.run(
        [*program, *map(str, arguments)], capture_output=True, text=True, timeout=300
    )


def activate(ob, *, only=True):
    if only:
        for other in bpy.context.view_layer.objects:
            other.select_set(False)
    ob.select_set(True)
    bpy.context.view_layer.objects.active = ob
    return ob


def grid(n=8, name="Grid", *, bump=0.3, uv=False, x=0.0):
    """A bumpy sheet of n x n quads."""
    t = np.linspace(-1, 1, n + 1)
    xs, ys = np.meshgrid(t, t, indexing="ij")
    zs = bump * np.exp(-3 * (xs**2 + ys**2))
    vertices = np.column_stack([xs.ravel() + x, ys.ravel(), zs.ravel()])
    faces = [
        (i * (n + 1) + j, (i + 1) * (n + 1) + j, (i + 1) * (n + 1) + j + 1, i * (n + 1) + j + 1)
        for i in range(n)
        for j in range(n)
    ]
    return add(name, vertices, faces, uv=uv)


def two_sheets(*, squeezed=False, pinned=True):
    """A large island (faces 0 to 15) and a small one (16 to 31), mapped by x, y and pinned all over unless told not to;
    `squeezed`: the small one is 20 times too flat."""
    large = grid(4, "Sheets", bump=0.0)
    small = grid(4, "Small", bump=0.0)
    for vertex in small.data.vertices:
        vertex.co = (vertex.co.x * 0.2 + 3.0, vertex.co.y * 0.2, 0.0)
    large.select_set(True)
    bpy.context.view_layer.objects.active = large
    bpy.ops.object.join()
    ob = bpy.context.object
    ob.data.uv_layers.new(name="UVMap")
    corner = np.array([loop.vertex_index for loop in ob.data.loops])
    uv = np.array([ob.data.vertices[v].co[:2] for v in corner], np.float32)
    if squeezed:
        uv[corner >= 25] *= np.float32([1.0, 0.05])
    set_uv(ob, (uv + 1) / 5)
    set_pins(ob, np.full(len(corner), pinned))
    return ob


def slow(name="Grid"):
    """A surface that takes the solver seconds: for watching and stopping it."""
    ob = grid(240, name, bump=6.0, uv=True)
    ob.display_type = "BOUNDS"  # so that drawing it takes no time
    return ob


def primitive(kind, **options):
    """One of Blender's own meshes."""
    getattr(bpy.ops.mesh, f"primitive_{kind}_add")(**options)
    return bpy.context.object


def cube(name="Cube"):
    ob = primitive("cube")
    ob.name = name
    return ob


def monkey(levels=1):
    """Suzanne, subdivided, cut open along her plane of symmetry: quads and triangles, several parts, holes."""
    ob = primitive("monkey")
    mesh = ob.data
    middle = np.array([abs(v.co.x) < 1e-6 for v in mesh.vertices])
    for edge in mesh.edges:
        edge.use_seam = bool(middle[list(edge.vertices)].all())
    if levels:
        modifier = ob.modifiers.new("Subdivision", "SUBSURF")
        modifier.levels = levels
        bpy.ops.object.modifier_apply(modifier=modifier.name)
    return ob


def stretched_monkey():
    """Unwrapped, then drawn out to the right: more so the further up."""
    ob = monkey(1)
    assert bpy.ops.uv.flipfree_unwrap() == {"FINISHED"}
    good = uv_of(ob)
    set_uv(ob, good * 0.7 + np.outer(good[:, 1] ** 2, [0.3, 0.0]))
    ob.data.update()
    return ob


def uv_of(ob, layer=None):
    """(loops, 2) float32, in either mode."""
    if ob.mode == "EDIT":
        ob.update_from_editmode()
        copy = ob.data.copy()
        values = _uv(copy, layer)
        bpy.data.meshes.remove(copy)
        return values
    return _uv(ob.data, layer)


def _uv(mesh, layer):
    uv_layer = mesh.uv_layers[layer] if layer else mesh.uv_layers.active
    values = np.empty((len(mesh.loops), 2), np.float32)
    uv_layer.uv.foreach_get("vector", values.ravel())
    return values


def set_uv(ob, values):
    flat = np.ascontiguousarray(values, np.float32).ravel()
    # Not through the layer: 4.3.2 writes into arrays shared with undo steps.
    ob.data.attributes[ob.data.uv_layers.active.name].data.foreach_set("vector", flat)


def corners(ob):
    """(loops,) the vertex of each."""
    return np.array([loop.vertex_index for loop in ob.data.loops])


def plane(ob):
    """(loops, 2) x and y of each corner."""
    return np.array([v.co[:2] for v in ob.data.vertices], np.float32)[corners(ob)]


def flat(ob):
    """UVs of the sheet = its x, y; returns these and the vertex of each loop."""
    set_uv(ob, plane(ob))
    return plane(ob), corners(ob)


def seam_in_the_middle(ob):
    """Along x = 0; returns (loops,) bool of what lies to the right."""
    for edge in ob.data.edges:
        edge.use_seam = all(abs(ob.data.vertices[v].co.x) < 1e-6 for v in edge.vertices)
    sizes = [p.loop_total for p in ob.data.polygons]
    return np.array([p.center.x > 0 for p in ob.data.polygons]).repeat(sizes)


def cut_all(ob):
    for edge in ob.data.edges:
        edge.use_seam = True
    return ob


def pins_of(ob):
    """(loops,) bool"""
    mask = np.empty(len(ob.data.loops), bool)
    ob.data.attributes[f".pn.{ob.data.uv_layers.active.name}"].data.foreach_get("value", mask)
    return mask


def set_pins(ob, loops):
    name = ob.data.uv_layers.active.name
    mask = np.zeros(len(ob.data.loops), bool)
    mask[loops] = True
    attribute = ob.data.attributes.get(f".pn.{name}")
    if attribute is None:
        attribute = ob.data.attributes.new(f".pn.{name}", "BOOLEAN", "CORNER")
    attribute.data.foreach_set("value", mask)


def enter(mode):
    """That mode; everything is selected in Edit Mode."""
    bpy.ops.object.mode_set(mode=mode)
    if mode == "EDIT":
        bpy.ops.mesh.select_all(action="SELECT")


def select(ob, kind, elements):
    """Selects these vertices, edges or faces only, in edit mode."""
    kinds = ("vertex", "edge", "face")
    bpy.context.tool_settings.mesh_select_mode = [kind == one for one in kinds]
    bpy.ops.mesh.select_all(action="DESELECT")
    bm = bmesh.from_edit_mesh(ob.data)
    sequence = (bm.verts, bm.edges, bm.faces)[kinds.index(kind)]
    sequence.ensure_lookup_table()
    for element in elements:
        sequence[element].select_set(True)
    bmesh.update_edit_mesh(ob.data)


def select_faces(ob, faces):
    select(ob, "face", faces)


def selected(ob, kind):
    """Indices of the selected vertices, edges or faces, in object mode."""
    sequence = {"vertex": ob.data.vertices, "edge": ob.data.edges, "face": ob.data.polygons}[kind]
    mask = np.empty(len(sequence), bool)
    sequence.foreach_get("select", mask)
    return np.flatnonzero(mask).tolist()


def selection(ob):
    """All that is selected in the object's mesh, and the select mode: what a failed run must leave alone as well."""
    mode = ob.mode
    if mode == "EDIT":
        ob.update_from_editmode()
    mesh = ob.data.copy()
    flags = [
        (name, _flags(mesh, name))
        for name in sorted(a.name for a in mesh.attributes)
        if "select" in name or name.startswith((".vs.", ".es."))
    ]
    bpy.data.meshes.remove(mesh)
    return flags, tuple(bpy.context.tool_settings.mesh_select_mode), mode


def _flags(mesh, name):
    """Of an attribute, whatever it holds: 5.0 can leave edges a selection of pairs of numbers, after joining objects."""
    attribute = mesh.attributes[name]
    if attribute.data_type == "BOOLEAN":
        values = np.empty(len(attribute.data), bool)
        attribute.data.foreach_get("value", values)
        return values.tobytes()
    return attribute.data_type, len(attribute.data)


def shown(kind):
    """What Select Where It Failed selects in the one object in Edit Mode afterwards; ends in object mode."""
    assert bpy.ops.uv.flipfree_select_failed() == {"FINISHED"}
    ob = bpy.context.edit_object
    bpy.ops.object.mode_set(mode="OBJECT")
    return selected(ob, kind)


def everything(ob):
    """All that a failed operator must leave alone: geometry, UVs, pins, seams."""
    mesh = ob.data
    co = np.empty(3 * len(mesh.vertices), np.float32)
    mesh.vertices.foreach_get("co", co)
    corners = np.empty(len(mesh.loops), np.int32)
    mesh.loops.foreach_get("vertex_index", corners)
    seams = np.empty(len(mesh.edges), bool)
    mesh.edges.foreach_get("use_seam", seams)
    layers = [(layer.name, uv_of(ob, layer.name).tobytes()) for layer in mesh.uv_layers]
    return co.tobytes(), corners.tobytes(), seams.tobytes(), layers


def refused(ob, words, call, **options):
    """The operator refuses in such words and leaves everything alone; returns the message."""
    before, chosen = everything(ob), selection(ob)
    message = None
    try:
        call(**options)
    except RuntimeError as error:
        message = str(error)
    assert message and re.search(words, message), message
    assert everything(ob) == before and selection(ob) == chosen
    return message


def exact_flips(ob):
    """Flipped or degenerate triangles of the stored UVs, by rational arithmetic that shares nothing with the solver."""
    return flips(triangles_of(ob)[1])


def face_of_triangles(ob):
    ob.data.calc_loop_triangles()
    return [t.polygon_index for t in ob.data.loop_triangles]


def triangles_of(ob):
    """((m, 3) vertices, (m, 3, 2) UVs) of the mesh as Blender triangulates it."""
    mesh = ob.data
    mesh.calc_loop_triangles()
    loops = np.array([t.loops for t in mesh.loop_triangles])
    vertices = np.array([loop.vertex_index for loop in mesh.loops])
    return vertices[loops], uv_of(ob)[loops]


def edges_with_loose_ends(ob):
    """Vertices that lie inside an edge of which they are no end: where a mesh came apart."""
    points = np.array([v.co for v in ob.data.vertices], float)
    found = []
    for edge in ob.data.edges:
        a, b = points[list(edge.vertices)]
        way = b - a
        share = (points - a) @ way / max(way @ way, 1e-30)
        off = np.linalg.norm(points - a - share[:, None] * way, axis=1)
        near = (off < 1e-5) & (share > 1e-3) & (share < 1 - 1e-3)
        found += [(edge.index, int(v)) for v in np.flatnonzero(near)]
    return found
