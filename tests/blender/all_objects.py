# SPDX-License-Identifier: GPL-3.0-or-later
"""Every kind of mesh that Blender itself makes, and meshes as imports leave them: {name: function}; each makes the active one."""

import bpy
import numpy as np
from broken_meshes import KINDS

add = bpy.ops.mesh


def _converted(make, change=lambda data: None):
    def made():
        make()
        change(bpy.context.object.data)
        bpy.context.object.select_set(True)
        bpy.ops.object.convert(target="MESH")

    return made


def _thick(data):
    data.extrude, data.bevel_depth = 0.2, 0.02


def _tube(data):
    data.bevel_depth = 0.2


def _modified(make, kind, **values):
    def made():
        make()
        modifier = bpy.context.object.modifiers.new("Modifier", kind)
        for name, value in values.items():
            setattr(modifier, name, value)
        bpy.ops.object.modifier_apply(modifier=modifier.name)

    return made


def _boolean(operation):
    def made():
        add.primitive_uv_sphere_add(location=(0.7, 0.4, 0.3))
        other = bpy.context.object
        add.primitive_cube_add()
        modifier = bpy.context.object.modifiers.new("Boolean", "BOOLEAN")
        modifier.operation, modifier.object = operation, other
        bpy.ops.object.modifier_apply(modifier=modifier.name)
        bpy.data.objects.remove(other)

    return made


def _metaballs():
    bpy.ops.object.metaball_add(type="BALL")
    bpy.context.object.data.elements.new(type="CUBE").co = (1.5, 0.0, 0.0)


def _loose_parts():
    add.primitive_monkey_add()
    for i in range(5):
        add.primitive_cone_add(location=(3.0 * i, 0.0, 0.0))
    bpy.ops.object.select_all(action="SELECT")
    bpy.ops.object.join()


def _joined_at_edges():
    """A house of cards: boxes that share edges, welded."""
    for x in (0.0, 2.0):
        for y in (0.0, 2.0):
            add.primitive_cube_add(location=(x, y, 0.0 if x == y else 2.0))
    bpy.ops.object.select_all(action="SELECT")
    bpy.ops.object.join()
    bpy.ops.object.mode_set(mode="EDIT")
    add.select_all(action="SELECT")
    add.remove_doubles()
    bpy.ops.object.mode_set(mode="OBJECT")


def _loose_edges():
    mesh = bpy.data.meshes.new("Loose")
    vertices = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (5, 5, 5), (6, 6, 6), (7, 7, 7)]
    mesh.from_pydata(vertices, [(4, 5)], [(0, 1, 2, 3)])
    mesh.materials.append(None)
    _link(mesh)


def _strange_polygons():
    """Concave, with collinear corners, meeting itself, and star-shaped."""
    mesh = bpy.data.meshes.new("Polygons")
    turn = np.arange(10) * np.pi / 5
    star = [(np.cos(t) * r, np.sin(t) * r, 0.0) for t, r in zip(turn, [2, 0.5] * 5, strict=True)]
    straight = [(5, 0, 0), (6, 0, 0), (7, 0, 0), (7, 1, 0), (6, 1, 0), (5, 1, 0)]
    crossed = [(10, 0, 0), (11, 1, 0), (11, 0, 0), (10, 1, 0)]
    flat = [(12, 0, 0), (13, 0, 0), (14, 0, 0), (15, 0, 0)]
    vertices = [tuple(map(float, v)) for v in star + straight + crossed + flat]
    faces = [range(10), range(10, 16), range(16, 20), range(20, 24)]
    mesh.from_pydata(vertices, [], [tuple(face) for face in faces])
    _link(mesh)


def _broken(kind):
    def made():
        vertices, faces = kind(np.random.default_rng(5))
        solid = [face for face in np.asarray(faces).tolist() if len(set(face)) == 3]
        mesh = bpy.data.meshes.new("Broken")
        mesh.from_pydata(np.asarray(vertices).tolist(), [], solid)
        _link(mesh)

    return made


def _link(mesh):
    ob = bpy.data.objects.new(mesh.name, mesh)
    bpy.context.collection.objects.link(ob)
    bpy.context.view_layer.objects.active = ob
    ob.select_set(True)


OBJECTS = {
    "plane": add.primitive_plane_add,
    "cube": add.primitive_cube_add,
    "circle": lambda: add.primitive_circle_add(fill_type="NGON"),
    "UV sphere": add.primitive_uv_sphere_add,
    "ico sphere": add.primitive_ico_sphere_add,
    "cylinder": add.primitive_cylinder_add,
    "cone": add.primitive_cone_add,
    "torus": add.primitive_torus_add,
    "grid": add.primitive_grid_add,
    "monkey": add.primitive_monkey_add,
    "text": _converted(bpy.ops.object.text_add),
    "text, thick": _converted(bpy.ops.object.text_add, _thick),
    "Bezier tube": _converted(bpy.ops.curve.primitive_bezier_circle_add, _tube),
    "NURBS path": _converted(bpy.ops.curve.primitive_nurbs_path_add, _tube),
    "NURBS sphere": _converted(bpy.ops.surface.primitive_nurbs_surface_sphere_add),
    "NURBS torus": _converted(bpy.ops.surface.primitive_nurbs_surface_torus_add),
    "metaballs": _converted(_metaballs),
    "difference": _boolean("DIFFERENCE"),
    "union": _boolean("UNION"),
    "intersection": _boolean("INTERSECT"),
    "solid monkey": _modified(add.primitive_monkey_add, "SOLIDIFY", thickness=0.05),
    "wireframe": _modified(add.primitive_cube_add, "WIREFRAME"),
    "screw": _modified(add.primitive_cube_add, "SCREW"),
    "loose parts": _loose_parts,
    "boxes that share edges": _joined_at_edges,
    "loose edges": _loose_edges,
    "strange polygons": _strange_polygons,
    **{f"broken: {kind.__name__.replace('_', ' ')}": _broken(kind) for kind in KINDS},
}
