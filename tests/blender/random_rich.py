# SPDX-License-Identifier: GPL-3.0-or-later
"""Rich meshes at random, and what must not change when an operator runs on them: for test_random_rich.py.

scene(seed)                    one to three objects: n-gons, several maps, hidden parts, all layers
everything(ob)                 {what: bytes} of all that the object and its mesh carry
"""

import bmesh
import bpy
import numpy as np
import rich
import shapes

import flipfree as ff

SEAMS = {"uv_seam", ".uv_seam"}
CONES = {"cone_angle"}
# Operator -> (options, what it may change beside the active map; names that end with * are beginnings).
OPERATORS = {
    "unwrap": ({}, set()),
    "unwrap, marked seams": ({"seams": "given", "mark_seams": True}, SEAMS),
    "improve": ({}, set()),
    "improve, packed": ({"pack": True}, set()),
    "repair": ({}, set()),
    "pack": ({"effort": 0.0}, set()),
    "check": ({}, {"selection"}),
    "conformal": ({}, SEAMS),
    "match": ({"max_seconds": 5.0}, set()),
    "match, rest": ({"rest": "unwrap", "max_seconds": 5.0}, set()),
    "seamless": ({}, SEAMS | CONES | {"seam_turns", "group Cone*"}),
    "field_aligned": (
        {"write_field": False},
        SEAMS | CONES | {"seam_turns", "group Cone*"},
    ),
    "auto_seams": ({}, SEAMS | {"not the map"}),
    "suggest_cones": ({}, CONES | {"not the map", "group Cone*"}),
    "clear_cones": ({}, CONES | {"not the map", "group Cone*"}),
    "orient": ({}, set()),
    "set_density": ({}, set()),
}


def scene(seed: int) -> list:
    """The objects, selected; the first one is active."""
    random = np.random.default_rng(seed)
    objects = [_object(random, f"Rich{i}", 3.0 * i) for i in range(random.integers(1, 4))]
    for ob in objects:
        ob.select_set(True)
    bpy.context.view_layer.objects.active = objects[0]
    return objects


def _object(random, name, x):
    n = int(random.integers(2, 6))
    ob = shapes.grid(n, name, bump=float(random.uniform(0.0, 0.8)), uv=True, x=x)
    _polygons(ob.data, random)
    mesh = ob.data
    rich.add_attributes(ob)
    for kind in ("INT", "BOOLEAN"):
        mesh.attributes.new(f"CORNER {kind}", kind, "CORNER")
        mesh.attributes.new(f"POINT {kind}", kind, "POINT")
    for attribute in list(mesh.attributes):
        if attribute.name.split(" ")[0] in ("POINT", "CORNER", "EDGE", "FACE"):
            _fill(attribute, mesh, random)
    for i in range(int(random.integers(1, 4))):
        mesh.uv_layers.new(name=f"Other{i}", do_init=False)
        _map(mesh, f"Other{i}", random, cut=bool(random.integers(2)))
    _map(mesh, "UVMap", random, cut=False)
    mesh.uv_layers.active = mesh.uv_layers["UVMap"]
    faces = len(mesh.polygons)
    mesh.attributes.new(".sculpt_face_set", "INT", "FACE")
    rich.set_values(mesh.attributes[".sculpt_face_set"], random.integers(1, 9, faces))
    for name, domain in (
        *(("crease_edge", "EDGE"), ("bevel_weight_edge", "EDGE")),
        *(("crease_vert", "POINT"), ("bevel_weight_vert", "POINT")),
    ):
        _fill(mesh.attributes.new(name, "FLOAT", domain), mesh, random)
    for letter in "AB":
        mesh.materials.append(bpy.data.materials.new(letter))
    mesh.polygons.foreach_set("material_index", random.integers(0, 2, faces).astype(np.int32))
    mesh.polygons.foreach_set("use_smooth", random.integers(0, 2, faces).astype(bool))
    for edge in mesh.edges:
        edge.use_seam = bool(random.random() < 0.1)
        edge.use_edge_sharp = bool(random.random() < 0.2)
    group = ob.vertex_groups.new(name="Weight")
    for vertex in range(len(mesh.vertices)):
        if random.random() < 0.7:
            group.add([vertex], float(random.random()), "REPLACE")
    if random.random() < 0.5:
        ob.shape_key_add(name="Basis")
        key = ob.shape_key_add(name="Up")
        for point in key.data:
            point.co.z += float(random.random())
    _pins(ob, random)
    if random.random() < 0.3:
        ob.vertex_groups.new(name="Cone +1").add([0], 1.0, "REPLACE")
    _hide(mesh, random)
    return ob


def _polygons(mesh, random):
    """Some quads are triangles, some are joined to larger polygons."""
    bm = bmesh.new()
    bm.from_mesh(mesh)
    inner = [edge for edge in bm.edges if len(edge.link_faces) == 2]
    chosen = [edge for edge in inner if random.random() < 0.15]
    bmesh.ops.dissolve_edges(bm, edges=chosen[:3], use_verts=False)
    quads = [face for face in bm.faces if len(face.verts) == 4 and random.random() < 0.2]
    bmesh.ops.triangulate(bm, faces=quads)
    for vertex in bm.verts:
        vertex.co.z += float(random.normal(0.0, 0.05))
    bm.to_mesh(mesh)
    bm.free()


def _fill(attribute, mesh, random):
    """By vertex where it is of corners, so that neighbours share a value, but for a few faces."""
    width = rich.KINDS[attribute.data_type][1]
    kind = rich.KINDS[attribute.data_type][2]
    count = len(attribute.data)
    if attribute.domain == "CORNER":
        vertex = np.array([loop.vertex_index for loop in mesh.loops])
        values = random.random((len(mesh.vertices), width))[vertex]
        own = np.repeat(random.random(len(mesh.polygons)) < 0.2, _sizes(mesh))
        values[own] = random.random((int(own.sum()), width))
    else:
        values = random.random((count, width))
    if kind is bool:
        values = values > 0.5
    elif np.issubdtype(kind, np.integer):
        values = np.floor(values * 100)
    rich.set_values(attribute, values)


def _sizes(mesh):
    return [polygon.loop_total for polygon in mesh.polygons]


def _map(mesh, name, random, *, cut):
    """Seen from above, a little askew; cut: some faces lie elsewhere."""
    corner = rich.places(mesh, "CORNER")
    uv = (corner[:, :2] - corner[:, :2].min(axis=0)) * random.uniform(0.1, 0.3, 2) + 0.1
    uv = uv.astype(np.float32)
    if cut:
        moved = np.repeat(random.random(len(mesh.polygons)) < 0.3, _sizes(mesh))
        uv[moved] += np.float32([2.0, 0.0])
    rich.set_values(mesh.attributes[name], uv)


def _pins(ob, random):
    """Of the active map, on a few vertices; some are somewhere else than the map has them."""
    vertex = shapes.corners(ob)
    chosen = random.choice(len(ob.data.vertices), int(random.integers(0, 5)), replace=False)
    pinned = np.isin(vertex, chosen)
    uv = shapes.uv_of(ob, "UVMap")
    for one in chosen[: int(random.integers(0, 3))]:
        uv[vertex == one] += random.normal(0.0, 0.05, 2).astype(np.float32)
    shapes.set_uv(ob, uv)
    shapes.set_pins(ob, pinned)


def _hide(mesh, random):
    hidden = random.random(len(mesh.polygons)) < 0.15
    hidden[int(random.integers(len(hidden)))] = False
    bm = bmesh.new()
    bm.from_mesh(mesh)
    for face, hide in zip(bm.faces, hidden.tolist(), strict=True):
        face.select_set(bool(random.random() < 0.7) and not hide)
    bm.to_mesh(mesh)
    bm.free()
    mesh.polygons.foreach_set("hide", hidden)


def everything(ob) -> dict:
    """In object mode. Selections are under "selection", the active map under "the map"."""
    mesh = ob.data
    found = {}
    for attribute in mesh.attributes:
        if attribute.data_type not in rich.KINDS:
            continue
        name = attribute.name
        name = "the map" if name == "UVMap" else name
        if "select" in name or name.startswith((".vs.", ".es.")):
            name = f"selection {name}"
        found[name] = attribute.domain, rich.values(attribute).tobytes()
    weights = {group.index: group.name for group in ob.vertex_groups}
    for index, name in weights.items():
        found[f"group {name}"] = [
            (v.index, g.weight) for v in mesh.vertices for g in v.groups if g.group == index
        ]
    if mesh.shape_keys is not None:
        for block in mesh.shape_keys.key_blocks:
            at = np.empty(3 * len(block.data), np.float32)
            block.data.foreach_get("co", at)
            found[f"shape {block.name}"] = at.tobytes()
    found["polygons"] = [tuple(polygon.vertices) for polygon in mesh.polygons]
    found["materials"] = [material.name for material in mesh.materials]
    found["maps"] = [layer.name for layer in mesh.uv_layers]
    return found


def changed(before: dict, after: dict, allowed: set) -> list[str]:
    """What is another, beyond what may be."""
    maps = set() if "not the map" in allowed else {"the map"}
    begins = tuple(name[:-1] for name in allowed if name.endswith("*"))
    if "selection" in allowed:
        begins += ("selection",)

    def may(name):
        return name in maps or name in allowed or name.startswith(begins)

    names = before.keys() | after.keys()
    return sorted(n for n in names if not may(n) and before.get(n) != after.get(n))


def certificates(ob) -> dict:
    """{map: what Check counts in it} of every map but the active one."""
    mesh = ob.data
    found = {}
    for layer in [layer.name for layer in mesh.uv_layers if layer.name != "UVMap"]:
        mesh.calc_loop_triangles()
        loops = np.array([t.loops for t in mesh.loop_triangles])
        vertex = np.array([loop.vertex_index for loop in mesh.loops])
        points = np.array([v.co for v in mesh.vertices], float)
        uv = shapes.uv_of(ob, layer)[loops]
        judged = ff.certify(points, vertex[loops], uv.astype(float))
        islands, torn = ff.islands(vertex[loops], uv)
        found[layer] = (
            len(np.unique(islands)),
            torn,
            judged.overlaps > 0,
            judged.flips32 > 0,
            judged.island_overlaps,
        )
    return found
