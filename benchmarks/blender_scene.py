"""Runs inside Blender: a scene of many small objects in one call, beside the sum of its parts, and what a first call costs.

    BLENDER_USER_RESOURCES=build/profile-blender-4.3 build/blender-4.3/blender -b --python-exit-code 1 \
        --python benchmarks/blender_scene.py -- [OBJECTS ...]

Objects: bumpy sheets of 500 triangles, each a mesh of its own, all different. CPU seconds of Unwrap Flip-Free

- first: the first call of the session, on one object, less the same call again;
- parts: each object unwrapped by a call of its own in a scene that holds nothing else (100 are measured, and their mean is taken for all);
- solver: ff.unwrap of the same arrays, one after another;
- together: one call with all objects selected; its islands are laid out together;
- of that packing: ff.pack of all their islands by itself.
"""

import sys
import time

import bpy
import numpy as np

import flipfree as ff

SIDE = (25, 10)
MEASURED = 100


def sheet(seed: int) -> tuple[np.ndarray, np.ndarray]:
    random = np.random.default_rng(seed)
    x, y = np.meshgrid(np.linspace(0, 1, SIDE[0] + 1), np.linspace(0, 0.4, SIDE[1] + 1))
    z = 0.1 * np.sin(random.uniform(2, 6) * x + random.uniform(0, 6)) * np.cos(5 * y)
    index = np.arange(x.size).reshape(x.shape)
    a, b = index[:-1, :-1].ravel(), index[:-1, 1:].ravel()
    c, d = index[1:, 1:].ravel(), index[1:, :-1].ravel()
    faces = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])
    return np.stack([x, y, z], -1).reshape(-1, 3), faces.astype(np.int32)


def add(seed: int) -> bpy.types.Object:
    vertices, faces = sheet(seed)
    mesh = bpy.data.meshes.new(f"sheet {seed}")
    mesh.from_pydata(vertices.tolist(), [], faces.tolist())
    ob = bpy.data.objects.new(f"sheet {seed}", mesh)
    bpy.context.scene.collection.objects.link(ob)
    ob.select_set(True)
    bpy.context.view_layer.objects.active = ob
    return ob


def clear() -> None:
    for mesh in list(bpy.data.meshes):
        bpy.data.meshes.remove(mesh)


def called() -> tuple[float, float]:
    """Wall and CPU seconds of one call."""
    wall, cpu = time.perf_counter(), time.process_time()
    assert bpy.ops.uv.flipfree_unwrap() == {"FINISHED"}
    return time.perf_counter() - wall, time.process_time() - cpu


def main() -> None:
    given = sys.argv[sys.argv.index("--") + 1 :] if "--" in sys.argv else []
    clear()
    add(0)
    first, again = called(), called()
    print(
        f"first call: {first[0] - again[0]:.3f} s more than the next, CPU {first[1] - again[1]:.3f}"
    )
    print("| objects | parts | solver | together | of that packing | together / parts |")
    print("|---|---|---|---|---|---|")
    for count in [int(n) for n in given] or [500, 5000]:
        parts = 0.0
        for seed in range(min(count, MEASURED)):
            clear()
            add(seed)
            parts += called()[1]
        parts *= count / min(count, MEASURED)
        start = time.process_time()
        maps = [ff.unwrap(*sheet(seed), seams="given") for seed in range(min(count, MEASURED))]
        solver = (time.process_time() - start) * count / min(count, MEASURED)
        clear()
        for seed in range(count):
            add(seed)
        together = called()[1]
        base = np.cumsum([0] + [len(maps[i % len(maps)].vertices) for i in range(count)])
        several = [maps[i % len(maps)] for i in range(count)]
        start = time.process_time()
        ff.pack(
            np.concatenate([m.vertices for m in several]),
            np.concatenate([m.faces + b for m, b in zip(several, base[:-1], strict=True)]),
            np.concatenate([m.uv for m in several]),
            effort=0.2,
        )
        packing = time.process_time() - start
        print(
            f"| {count} | {parts:.1f} | {solver:.1f} | {together:.1f} | {packing:.1f} | {together / parts:.2f} |",
            flush=True,
        )


main()
