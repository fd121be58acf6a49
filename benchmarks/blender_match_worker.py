"""Runs inside Blender: unwraps the largest island of a subdivided monkey with six moved pins, by every method of Blender's own.

    blender -b --factory-startup --python-exit-code 1 --python benchmarks/blender_match_worker.py -- \
        LEVELS OUT.npz SEEDS SHARES

The island's pins are random inner vertices, moved from their place in Blender's own Minimum Stretch layout into a random direction by
a share of the unit square. Only that island is selected, so nothing else is timed. Writes triangles, pins and, per method, UVs with
wall-clock and CPU seconds. Part of match_vs_blender.py.
"""

import os
import sys
import time
from pathlib import Path

import bpy
import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent))
sys.dont_write_bytecode = True

from blender_monkey import subdivided_monkey  # noqa: E402

PINS = 6
METHODS = {
    "Conformal": {"method": "CONFORMAL"},
    "Angle Based": {"method": "ANGLE_BASED"},
    "Minimum Stretch": {"method": "MINIMUM_STRETCH", "no_flip": False},
    "Minimum Stretch, No Flip": {"method": "MINIMUM_STRETCH", "no_flip": True},
}


def values(collection, name, count, dtype, width):
    array = np.empty(count * width, dtype)
    collection.foreach_get(name, array)
    return array.reshape(count, width) if width > 1 else array


def store_uv(mesh, uv) -> None:
    # Through the attribute: uv_layer.uv writes into arrays shared with copies of the mesh in 4.3.2.
    flat = np.ascontiguousarray(uv, np.float32).ravel()
    mesh.attributes[mesh.uv_layers.active.name].data.foreach_set("vector", flat)


def store_pins(mesh, mask) -> None:
    # Not through the layer's pin_uv, which 4.3.2 corrupts.
    name = f".pn.{mesh.uv_layers.active.name}"
    if mesh.attributes.get(name) is None:
        mesh.attributes.new(name, "BOOLEAN", "CORNER")
    mesh.attributes[name].data.foreach_set("value", np.ascontiguousarray(mask))


def islands(corners, seam_edges) -> np.ndarray:
    """(m,) smallest triangle of each triangle's seam island."""
    m = len(corners)
    start, end = corners.ravel(), np.roll(corners, -1, axis=1).ravel()
    key = np.minimum(start, end).astype(np.int64) << 32 | np.maximum(start, end)
    seams = seam_edges.min(1).astype(np.int64) << 32 | seam_edges.max(1)
    order = np.argsort(key, kind="stable")
    joined = (key[order][1:] == key[order][:-1]) & ~np.isin(key[order][1:], seams)
    a, b = order[:-1][joined] // 3, order[1:][joined] // 3
    label = np.arange(m)
    while True:
        low = np.minimum(label[a], label[b])
        before = label.copy()
        np.minimum.at(label, a, low)
        np.minimum.at(label, b, low)
        label = label[label]
        if np.array_equal(label, before):
            return label


def unwrap(mesh, **options) -> tuple[np.ndarray, list[float]]:
    """UVs (m, 3, 2) and (wall, CPU) seconds of one call on the selected faces."""
    bpy.ops.object.mode_set(mode="EDIT")
    wall, cpu = time.perf_counter(), time.process_time()
    assert bpy.ops.uv.unwrap(margin=0.001, **options) == {"FINISHED"}
    seconds = [time.perf_counter() - wall, time.process_time() - cpu]
    bpy.ops.object.mode_set(mode="OBJECT")
    return values(mesh.uv_layers.active.uv, "vector", len(mesh.loops), np.float32, 2).reshape(
        -1, 3, 2
    ), seconds


def main() -> None:
    levels, out, seeds, shares = sys.argv[sys.argv.index("--") + 1 :]
    mesh = subdivided_monkey(int(levels)).data
    corners = values(mesh.loops, "vertex_index", len(mesh.loops), np.int32, 1).reshape(-1, 3)
    assert len(corners) == len(mesh.polygons)
    seam = values(mesh.edges, "use_seam", len(mesh.edges), bool, 1)
    ends = values(mesh.edges, "vertices", len(mesh.edges), np.int32, 2)
    mesh.polygons.foreach_set("select", np.ones(len(mesh.polygons), bool))
    mesh.update()
    layout, _ = unwrap(mesh, method="MINIMUM_STRETCH", no_flip=True)

    label = islands(corners, ends[seam])
    roots, sizes = np.unique(label, return_counts=True)
    chosen = label == roots[np.argmax(sizes)]
    sides, uses = np.unique(
        np.sort(corners[chosen][:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), 1),
        axis=0,
        return_counts=True,
    )
    rim = np.concatenate([sides[uses == 1].ravel(), ends[seam].ravel()])
    inner = np.setdiff1d(corners[chosen], rim)
    data = {
        "vertices": values(mesh.vertices, "co", len(mesh.vertices), np.float32, 3).astype(
            np.float64
        ),
        "faces": corners[chosen],
        "seams": ends[seam],
        "layout": layout[chosen],
        "methods": np.array(list(METHODS)),
    }
    mesh.polygons.foreach_set("select", chosen)
    mesh.update()
    for share in shares.split(","):
        for seed in seeds.split(","):
            random = np.random.default_rng(int(seed))
            pins = random.choice(inner, PINS, replace=False)
            angle = random.uniform(0.0, 2 * np.pi, PINS)
            move = float(share) * np.column_stack([np.cos(angle), np.sin(angle)])
            moved = layout.reshape(-1, 2).copy()
            is_pin = np.isin(corners.ravel(), pins) & np.repeat(chosen, 3)
            for vertex, offset in zip(pins, move, strict=True):
                moved[is_pin & (corners.ravel() == vertex)] += offset.astype(np.float32)
            case = f"{share}_{seed}"
            data[f"{case}_pins"] = pins
            data[f"{case}_targets"] = np.array(
                [moved[is_pin & (corners.ravel() == v)][0] for v in pins]
            )
            for name, options in METHODS.items():
                store_uv(mesh, moved)
                store_pins(mesh, is_pin)
                uv, seconds = unwrap(mesh, **options)
                data[f"{case}_{name}_uv"] = uv[chosen]
                data[f"{case}_{name}_seconds"] = np.array(seconds)
    np.savez(out, **data)
    sys.stdout.flush()
    # 4.3.2 can crash while Python is torn down after long scripts; everything is written.
    os._exit(0)


main()
