"""Runs inside Blender: unwraps meshes, moves some pins of the map, unwraps again, and writes the map that comes out.

    blender -b --factory-startup --python-exit-code 1 --python benchmarks/blender_pins_worker.py -- FOLDER

FOLDER/SEED.mesh.npz -> FOLDER/SEED.npz. Method, number of pins and how far they move are random, by the seed. Part of repair_maps.py.
"""

import os
import sys
from pathlib import Path

import bpy
import numpy as np

METHODS = ("ANGLE_BASED", "CONFORMAL")


def unwrap(mesh, method: str) -> np.ndarray:
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="SELECT")
    assert bpy.ops.uv.unwrap(method=method, margin=0.001) == {"FINISHED"}
    bpy.ops.object.mode_set(mode="OBJECT")
    uv = np.empty(2 * len(mesh.loops), np.float32)
    mesh.uv_layers.active.uv.foreach_get("vector", uv)
    return uv.reshape(-1, 3, 2)


def store(mesh, uv, pinned) -> None:
    # Through attributes: what the layer itself offers is shared or corrupt in 4.3.2.
    layer = mesh.uv_layers.active.name
    mesh.attributes[layer].data.foreach_set("vector", np.ascontiguousarray(uv, np.float32).ravel())
    if mesh.attributes.get(f".pn.{layer}") is None:
        mesh.attributes.new(f".pn.{layer}", "BOOLEAN", "CORNER")
    mesh.attributes[f".pn.{layer}"].data.foreach_set("value", np.ascontiguousarray(pinned))


def spoilt_map(seed: int, given) -> np.ndarray:
    random = np.random.default_rng(seed)
    vertices, faces, seams = given["vertices"], given["faces"], given["seams"]
    for old in list(bpy.data.meshes):
        bpy.data.meshes.remove(old)
    mesh = bpy.data.meshes.new("mesh")
    mesh.from_pydata(vertices.tolist(), [], faces.tolist())
    ob = bpy.data.objects.new("mesh", mesh)
    bpy.context.scene.collection.objects.link(ob)
    bpy.context.view_layer.objects.active = ob
    ob.select_set(True)
    ends = np.empty(2 * len(mesh.edges), np.int32)
    mesh.edges.foreach_get("vertices", ends)
    marked = {tuple(sorted(edge)) for edge in seams.tolist()}
    mesh.edges.foreach_set(
        "use_seam", [tuple(sorted(edge)) in marked for edge in ends.reshape(-1, 2).tolist()]
    )
    mesh.uv_layers.new(name="map")
    method = METHODS[random.integers(len(METHODS))]
    uv = unwrap(mesh, method)
    # Corners of one vertex at one place are one pin.
    key = np.column_stack([faces.ravel(), uv.reshape(-1, 2)])
    _, point = np.unique(key, axis=0, return_inverse=True)
    point = point.ravel()
    chosen = random.choice(point.max() + 1, int(random.integers(3, 9)), replace=False)
    pinned = np.isin(point, chosen)
    reach = 10.0 ** random.uniform(-1.5, 0.0)
    shift = np.zeros((point.max() + 1, 2))
    shift[chosen[: len(chosen) // 2 + 1]] = random.normal(size=(len(chosen) // 2 + 1, 2)) * reach
    store(mesh, uv.reshape(-1, 2) + shift[point], pinned)
    return unwrap(mesh, method)


def main() -> None:
    folder = Path(sys.argv[sys.argv.index("--") + 1])
    for path in sorted(folder.glob("*.mesh.npz")):
        seed = int(path.name.split(".")[0])
        given = np.load(path)
        np.savez(folder / f"{seed}.npz", uv=spoilt_map(seed, given), **given)
    sys.stdout.flush()
    # 4.3.2 can crash while Python is torn down after long scripts; everything is written.
    os._exit(0)


main()
