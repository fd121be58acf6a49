"""Runs inside Blender: what peers of other benchmarks need of it, started by runner.py.

    blender -b --factory-startup --python-exit-code 1 --python benchmarks/blender_worker.py -- VERB ...

    unwrap OUT.npz LEVELS METHOD ...      a subdivided monkey, its own islands as seams, by methods of Blender's own
    match OUT.npz LEVELS SEEDS SHARES     its largest island with six pins moved by shares of the square, by all methods
    pack OUT.npz IN.npz GAP SECONDS       Pack Islands on a flat mesh's islands, several times
    smart FOLDER                          Smart UV Project: NAME.npz with vertices and faces -> NAME.smart.npz
    pins FOLDER                           SEED.mesh.npz unwrapped, some pins moved, unwrapped again -> SEED.npz
    quadriflow OUT.npz IN.npz TARGET      QuadriFlow Remesh
    parts OUT.npz                         parts of machines: NAME.vertices and NAME.faces of each

Seconds are (wall clock, CPU) of the operator alone. match: pins are random inner vertices, moved from their place in Blender's own
Minimum Stretch layout; only that island is selected, so nothing else is timed. pack: what Blender makes differs from press to press
within a session and by the rotations that it may take, so all are tried until SECONDS of CPU are over. The margin method is Add, whose
margin is added on either side of an island before all are scaled to the square: for GAP, a share of the square, it follows from the
fill, of which that of the press before is the guess.
"""

import os
import sys
import time
from pathlib import Path

import bmesh
import bpy
import numpy as np

PINS = 6
METHODS = {
    "Conformal": {"method": "CONFORMAL"},
    "Angle Based": {"method": "ANGLE_BASED"},
    "Minimum Stretch": {"method": "MINIMUM_STRETCH", "no_flip": False},
    "Minimum Stretch, No Flip": {"method": "MINIMUM_STRETCH", "no_flip": True},
}
PRESSES = 4
ROTATIONS = ("ANY", "AXIS_ALIGNED", "CARDINAL")


def values(collection, name, dtype, width):
    array = np.empty(len(collection) * width, dtype)
    collection.foreach_get(name, array)
    return array.reshape(-1, width) if width > 1 else array


def uv_of(mesh):
    return values(mesh.uv_layers.active.uv, "vector", np.float32, 2).reshape(-1, 3, 2)


def store(mesh, uv, pinned):
    # Through attributes: what the layer itself offers is shared with copies of the mesh, or corrupt, in 4.3.2.
    layer = mesh.uv_layers.active.name
    mesh.attributes[layer].data.foreach_set("vector", np.ascontiguousarray(uv, np.float32).ravel())
    if mesh.attributes.get(f".pn.{layer}") is None:
        mesh.attributes.new(f".pn.{layer}", "BOOLEAN", "CORNER")
    mesh.attributes[f".pn.{layer}"].data.foreach_set("value", np.ascontiguousarray(pinned))


def added(vertices, faces):
    """The only object's mesh."""
    for old in list(bpy.data.meshes):
        bpy.data.meshes.remove(old)
    mesh = bpy.data.meshes.new("mesh")
    mesh.from_pydata(vertices.tolist(), [], faces.tolist())
    mesh.uv_layers.new(name="UVMap")
    ob = bpy.data.objects.new("mesh", mesh)
    bpy.context.scene.collection.objects.link(ob)
    bpy.context.view_layer.objects.active = ob
    ob.select_set(True)
    return mesh


def called(mesh, operator, whole=True, **options):
    """UVs (m, 3, 2) and seconds of one call on the selected faces, or on all."""
    bpy.ops.object.mode_set(mode="EDIT")
    if whole:
        bpy.ops.mesh.select_all(action="SELECT")
        bpy.ops.uv.select_all(action="SELECT")
    wall, cpu = time.perf_counter(), time.process_time()
    assert operator(**options) == {"FINISHED"}
    seconds = [time.perf_counter() - wall, time.process_time() - cpu]
    bpy.ops.object.mode_set(mode="OBJECT")
    return uv_of(mesh), seconds


def subdivided_monkey(levels):
    """Blender's monkey as triangles, subdivided so often, alone in the scene; its UV islands are seams."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.mesh.primitive_monkey_add(calc_uvs=True)
    monkey = bpy.context.object
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="SELECT")
    bpy.ops.uv.select_all(action="SELECT")
    bpy.ops.uv.seams_from_islands()
    bpy.ops.object.mode_set(mode="OBJECT")
    modifier = monkey.modifiers.new("Subdivision", "SUBSURF")
    modifier.levels = levels
    bpy.ops.object.modifier_apply(modifier=modifier.name)
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="SELECT")
    bpy.ops.mesh.quads_convert_to_tris()
    bpy.ops.object.mode_set(mode="OBJECT")
    return monkey.data


def arrays_of(mesh):
    ends = values(mesh.edges, "vertices", np.int32, 2)
    return {
        "vertices": values(mesh.vertices, "co", np.float32, 3).astype(np.float64),
        "faces": values(mesh.loops, "vertex_index", np.int32, 1).reshape(-1, 3),
        "seams": ends[values(mesh.edges, "use_seam", bool, 1)],
    }


def unwrap(out, levels, *methods):
    mesh = subdivided_monkey(int(levels))
    data = arrays_of(mesh)
    for method in methods:
        made = called(mesh, bpy.ops.uv.unwrap, method=method, margin=0.001)
        data[f"{method}_uv"], data[f"{method}_seconds"] = made
    np.savez(out, **data)


def islands(corners, seam_edges):
    """(m,) smallest triangle of each triangle's seam island."""
    start, end = corners.ravel(), np.roll(corners, -1, axis=1).ravel()
    key = np.minimum(start, end).astype(np.int64) << 32 | np.maximum(start, end)
    seams = seam_edges.min(1).astype(np.int64) << 32 | seam_edges.max(1)
    order = np.argsort(key, kind="stable")
    joined = (key[order][1:] == key[order][:-1]) & ~np.isin(key[order][1:], seams)
    a, b = order[:-1][joined] // 3, order[1:][joined] // 3
    label = np.arange(len(corners))
    while True:
        low = np.minimum(label[a], label[b])
        before = label.copy()
        np.minimum.at(label, a, low)
        np.minimum.at(label, b, low)
        label = label[label]
        if np.array_equal(label, before):
            return label


def match(out, levels, seeds, shares):
    mesh = subdivided_monkey(int(levels))
    data = arrays_of(mesh)
    corners, seams = data["faces"], data["seams"]
    layout, _ = called(mesh, bpy.ops.uv.unwrap, margin=0.001, **METHODS["Minimum Stretch, No Flip"])
    label = islands(corners, seams)
    roots, sizes = np.unique(label, return_counts=True)
    chosen = label == roots[np.argmax(sizes)]
    sides, uses = np.unique(
        np.sort(corners[chosen][:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), 1),
        axis=0,
        return_counts=True,
    )
    rim = np.concatenate([sides[uses == 1].ravel(), seams.ravel()])
    inner = np.setdiff1d(corners[chosen], rim)
    data |= {"faces": corners[chosen], "layout": layout[chosen], "methods": np.array([*METHODS])}
    mesh.polygons.foreach_set("select", chosen)
    mesh.update()
    for case in [f"{share}_{seed}" for share in shares.split(",") for seed in seeds.split(",")]:
        share, seed = case.split("_")
        random = np.random.default_rng(int(seed))
        pins = random.choice(inner, PINS, replace=False)
        angle = random.uniform(0.0, 2 * np.pi, PINS)
        move = float(share) * np.column_stack([np.cos(angle), np.sin(angle)])
        moved = layout.reshape(-1, 2).copy()
        is_pin = np.isin(corners.ravel(), pins) & np.repeat(chosen, 3)
        for vertex, offset in zip(pins, move, strict=True):
            moved[is_pin & (corners.ravel() == vertex)] += offset.astype(np.float32)
        targets = [moved[is_pin & (corners.ravel() == v)][0] for v in pins]
        data[f"{case}_pins"], data[f"{case}_targets"] = pins, np.array(targets)
        for name, options in METHODS.items():
            store(mesh, moved, is_pin)
            uv, seconds = called(mesh, bpy.ops.uv.unwrap, whole=False, margin=0.001, **options)
            data[f"{case}_{name}_uv"], data[f"{case}_{name}_seconds"] = uv[chosen], seconds
    np.savez(out, **data)


def area(uv):
    a, b = uv[:, 1] - uv[:, 0], uv[:, 2] - uv[:, 0]
    return float(np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum() / 2)


def pack(out, source, gap, most):
    data = np.load(source)
    uv = data["uv"]
    mesh = added(data["vertices"], data["faces"])
    packed, seconds = [], []
    fill = dict.fromkeys(ROTATIONS, 0.6)
    for rotation in ROTATIONS * PRESSES:
        if seconds and np.sum(seconds, axis=0)[1] > float(most):
            break
        margin = 0.5 * float(gap) * np.sqrt(area(uv) / (0.98 * fill[rotation]))
        mesh.uv_layers.active.uv.foreach_set("vector", uv.astype(np.float32).ravel())
        made, took = called(
            mesh,
            bpy.ops.uv.pack_islands,
            rotate=True,
            rotate_method=rotation,
            scale=True,
            margin_method="ADD",
            margin=float(margin),
            shape_method="CONCAVE",
        )
        fill[rotation] = area(made.astype(np.float64))
        packed.append(made)
        seconds.append(took)
    np.savez(out, uv=np.stack(packed), seconds=seconds)


def smart(folder):
    for source in sorted(Path(folder).glob("*.npz")):
        data = np.load(source)
        mesh = added(data["vertices"], data["faces"])
        uv, seconds = called(mesh, bpy.ops.uv.smart_project)  # 66 degrees
        np.savez(source.with_suffix(".smart.npz"), uv=uv, seconds=seconds)


def map_with_moved_pins(seed, given):
    """Method, number of pins and how far they move are random, by the seed."""
    random = np.random.default_rng(seed)
    mesh = added(given["vertices"], given["faces"])
    marked = {tuple(sorted(edge)) for edge in given["seams"].tolist()}
    ends = values(mesh.edges, "vertices", np.int32, 2).tolist()
    mesh.edges.foreach_set("use_seam", [tuple(sorted(edge)) in marked for edge in ends])
    method = ("ANGLE_BASED", "CONFORMAL")[random.integers(2)]
    uv, _ = called(mesh, bpy.ops.uv.unwrap, method=method, margin=0.001)
    # Corners of one vertex at one place are one pin.
    key = np.column_stack([given["faces"].ravel(), uv.reshape(-1, 2)])
    point = np.unique(key, axis=0, return_inverse=True)[1].ravel()
    chosen = random.choice(point.max() + 1, int(random.integers(3, 9)), replace=False)
    reach = 10.0 ** random.uniform(-1.5, 0.0)
    shift = np.zeros((point.max() + 1, 2))
    shift[chosen[: len(chosen) // 2 + 1]] = random.normal(size=(len(chosen) // 2 + 1, 2)) * reach
    store(mesh, uv.reshape(-1, 2) + shift[point], np.isin(point, chosen))
    return called(mesh, bpy.ops.uv.unwrap, method=method, margin=0.001)[0]


def pins(folder):
    for path in sorted(Path(folder).glob("*.mesh.npz")):
        seed = int(path.name.split(".")[0])
        given = np.load(path)
        np.savez(Path(folder) / f"{seed}.npz", uv=map_with_moved_pins(seed, given), **given)


def quadriflow(out, source, target):
    """Blender's own quads of a mesh: faces of four corners, and seconds of CPU."""
    given = np.load(source)
    added(given["vertices"], given["faces"])
    cpu = time.process_time()
    answer = bpy.ops.object.quadriflow_remesh(target_faces=int(target), seed=0)
    cpu = time.process_time() - cpu
    mesh = bpy.context.object.data
    corners = values(mesh.loops, "vertex_index", np.int32, 1)
    made = answer == {"FINISHED"} and len(corners) == 4 * len(mesh.polygons)
    faces = corners.reshape(-1, 4) if made else np.zeros((0, 4), np.int32)
    np.savez(out, vertices=values(mesh.vertices, "co", np.float32, 3), quads=faces, cpu=cpu)


def parts(out):
    """By Blender's own primitives, bevels and exact booleans; edges shorter than 1e-4 merged."""
    add = bpy.ops.mesh

    def cylinder(radius, depth, place=(0, 0, 0), turn=(0, 0, 0)):
        return add.primitive_cylinder_add, dict(
            radius=radius, depth=depth, location=place, rotation=turn, vertices=48
        )

    def block(size, place=(0, 0, 0), turn=(0, 0, 0)):
        return add.primitive_cube_add, dict(size=1, scale=size, location=place, rotation=turn)

    def ball(radius, place):
        return add.primitive_uv_sphere_add, dict(
            radius=radius, location=place, segments=48, ring_count=24
        )

    across, along = (np.pi / 2, 0, 0), (0, np.pi / 2, 0)
    steps = [("UNION", block((3 - 0.6 * i, 2, 0.3), (-0.3 * i, 0, 0.3 * i))) for i in range(1, 4)]
    recipes = {
        "fillets": [("", block((2, 3, 1))), ("BEVEL", 0.3)],
        "cylinders": [("", cylinder(1, 3)), ("UNION", cylinder(0.6, 4, turn=across))],
        "crossing": [
            *(("", cylinder(0.8, 4)), ("UNION", cylinder(0.8, 3.5, (0, 0, 0.3), along))),
            ("UNION", cylinder(0.5, 3, (0, 0, -1), across)),
        ],
        "joint": [
            *(("", ball(1, (0, 0, 0))), ("UNION", cylinder(0.5, 2, (0, 0, -1.4)))),
            *(
                ("UNION", block((1.6, 0.6, 0.5), (0, 0, -2.3))),
                ("DIFFERENCE", cylinder(0.35, 4, turn=across)),
            ),
        ],
        "stage": [("", block((3, 2, 0.3))), *steps, ("DIFFERENCE", cylinder(0.4, 4, (-0.9, 0, 0)))],
        "wingnut": [
            *(
                ("", cylinder(1, 1.4)),
                ("UNION", block((2, 0.35, 1.6), (1.3, 0, 0.7), (0, -0.5, 0))),
            ),
            ("UNION", block((2, 0.35, 1.6), (-1.3, 0, 0.7), (0, 0.5, 0))),
            ("DIFFERENCE", cylinder(0.45, 4)),
        ],
    }
    arrays = {}
    for name, ((_, (first, options)), *rest) in recipes.items():
        first(**options)
        part = bpy.context.object
        for kind, what in rest:
            bpy.context.view_layer.objects.active = part
            if kind == "BEVEL":
                bpy.ops.object.transform_apply()
                made = part.modifiers.new("", "BEVEL")
                made.width, made.segments = what, 2
            else:
                what[0](**what[1])
                made = part.modifiers.new("", "BOOLEAN")
                made.operation, made.object = kind, bpy.context.object
        evaluated = part.evaluated_get(bpy.context.evaluated_depsgraph_get())
        work = bmesh.new()
        work.from_mesh(evaluated.to_mesh())
        work.transform(part.matrix_world)
        bmesh.ops.remove_doubles(work, verts=work.verts, dist=1e-4)
        bmesh.ops.triangulate(work, faces=work.faces)
        work.verts.index_update()
        arrays[f"{name}.vertices"] = np.array([v.co for v in work.verts], np.float64)
        arrays[f"{name}.faces"] = np.array(
            [[v.index for v in f.verts] for f in work.faces], np.int32
        )
    np.savez(out, **arrays)


verb, *rest = sys.argv[sys.argv.index("--") + 1 :]
{
    **{"unwrap": unwrap, "match": match, "pack": pack, "smart": smart, "pins": pins},
    **{"quadriflow": quadriflow, "parts": parts},
}[verb](*rest)
sys.stdout.flush()
# 4.3.2 can crash while Python is torn down after long scripts; everything is written.
os._exit(0)
