"""The large mesh of benchmarks that run in Blender, and what the operators that they ask about need."""

import importlib
import sys

import bpy
import numpy as np

EXTENSION = "bl_ext.user_default.flipfree_uv"

#: name -> (module of its tasks, class, options)
TASKS = {
    "unwrap": ("operators.unwrap", "UnwrapTask", {}),
    "check": ("operators.check", "CheckTask", {}),
    "pack": ("operators.packing.pack", "PackTask", {}),
    "improve": ("operators.mending.improve", "ImproveTask", {"iterations": 3}),
}


def arguments():
    """What follows `--`."""
    return sys.argv[sys.argv.index("--") + 1 :] if "--" in sys.argv else []


def part(name):
    """A module of the extension, which must be enabled."""
    return importlib.import_module(f"{EXTENSION}.{name}")


def sheet(side):
    """The only object: side * side quads, a wavy sheet whose UVs are its plane's."""
    bpy.data.batch_remove(list(bpy.data.objects))
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=side, y_subdivisions=side)
    mesh = bpy.context.object.data
    places = np.empty((len(mesh.vertices), 3), np.float32)
    mesh.vertices.foreach_get("co", places.ravel())
    places[:, 2] = 0.1 * np.sin(9 * places[:, 0]) * np.cos(7 * places[:, 1])
    mesh.vertices.foreach_set("co", places.ravel())
    mesh.update()
    return bpy.context.object
