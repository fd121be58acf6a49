# SPDX-License-Identifier: GPL-3.0-or-later
"""Islands as they are stored, and where they lie."""

import bpy
import numpy as np
import shapes

from judges.charts import charts_of
from judges.gaps import area, narrowest


def _islands(ob):
    """(UV triangles (k, 3, 2), their places in the scene (k, 3, 3)) of each island."""
    corners, uv = shapes.triangles_of(ob)
    world = np.array(ob.matrix_world)
    points = np.array([v.co for v in ob.data.vertices]) @ world[:3, :3].T
    chart = charts_of(corners, uv).face
    every = [chart == i for i in range(chart.max() + 1)]
    return [(uv[own].astype(np.float64), points[corners[own]]) for own in every]


def islands(*objects):
    """UV triangles (k, 3, 2) of each island of these objects."""
    return [uv for ob in objects for uv, _ in _islands(ob)]


def densities(*objects):
    """Length in UV space per length of the surface as it stands in the scene, of each island."""
    found = []
    for ob in objects:
        for uv, at in _islands(ob):
            sides = np.cross(at[:, 1] - at[:, 0], at[:, 2] - at[:, 0])
            found.append(np.sqrt(area(uv) / (np.linalg.norm(sides, axis=1).sum() / 2)))
    return np.array(found)


def assert_usable(*objects, of):
    """So many islands, none outside the unit square or on top of another."""
    found = islands(*objects)
    assert len(found) == of
    assert all(one.min() >= 0.0 and one.max() <= 1.0 for one in found)
    assert narrowest(found, 1e-3).distance > 0.0
    return found


def cylinder_with_seams():
    """A cylinder with caps, cut along both rims and one line down its side; its UVs are Blender's own."""
    ob = shapes.primitive("cylinder", vertices=32, radius=1.0, depth=2.0)
    mesh = ob.data
    z = [v.co.z for v in mesh.vertices]
    upright = [e for e in mesh.edges if z[e.vertices[0]] != z[e.vertices[1]]]
    for edge in mesh.edges:
        edge.use_seam = z[edge.vertices[0]] == z[edge.vertices[1]]
    upright[0].use_seam = True
    return ob


def cube_with_seams(name="Cube", scale=(1.0, 1.0, 1.0)):
    ob = shapes.cut_all(shapes.cube(name))
    ob.scale = scale
    bpy.context.view_layer.update()
    return ob


def both(first, second):
    """These two, selected."""
    shapes.activate(first, only=False)
    shapes.activate(second, only=False)
    return first, second
