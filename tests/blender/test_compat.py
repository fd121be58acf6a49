# SPDX-License-Identifier: GPL-3.0-or-later
"""Each difference between Blender's versions that addon/compat.py hides."""

import bmesh
import bpy
import numpy as np
import shapes


def test_uv_values_come_back_bit_for_bit(part):
    ob = shapes.grid(4, uv=True)
    values = np.random.default_rng(0).random((len(ob.data.loops), 2), np.float32)
    part("compat").set_uv_values(ob.data, "UVMap", values)
    assert part("compat").uv_values(ob.data, "UVMap").tobytes() == values.tobytes()
    # Blender's slow interface sees the same.
    assert tuple(ob.data.uv_layers.active.data[5].uv) == tuple(map(float, values[5]))


def test_writing_uvs_and_seams_does_not_reach_copies_of_the_mesh(part):
    """Copies and undo steps share arrays with the mesh until one of them is written."""
    compat = part("compat")
    ob = shapes.grid(3, uv=True)
    copy = ob.data.copy()
    before = compat.uv_values(copy, "UVMap")
    compat.set_uv_values(ob.data, "UVMap", before + 1)
    compat.set_seam_edges(ob.data, np.ones(len(ob.data.edges), bool))
    assert compat.uv_values(copy, "UVMap").tobytes() == before.tobytes()
    assert not compat.seam_edges(copy).any()


def test_pins_set_in_the_uv_editor_are_read(part):
    ob = shapes.grid(4, uv=True)
    bpy.ops.object.mode_set(mode="EDIT")
    bm = bmesh.from_edit_mesh(ob.data)
    layer = bm.loops.layers.uv.verify()
    bm.faces.ensure_lookup_table()
    bm.faces[3].loops[1][layer].pin_uv = True
    bpy.ops.object.mode_set(mode="OBJECT")
    expected = ob.data.polygons[3].loop_start + 1
    assert np.flatnonzero(part("compat").pinned_loops(ob.data, "UVMap")).tolist() == [expected]


def test_mesh_without_pins_has_none(part):
    ob = shapes.grid(3, uv=True)
    assert not part("compat").pinned_loops(ob.data, "UVMap").any()


def test_seams_are_those_that_mark_seam_makes(part):
    ob = shapes.grid(3)
    bpy.context.tool_settings.mesh_select_mode = (False, True, False)
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="DESELECT")
    bm = bmesh.from_edit_mesh(ob.data)
    bm.edges.ensure_lookup_table()
    bm.edges[4].select_set(True)
    bmesh.update_edit_mesh(ob.data)
    bpy.ops.mesh.mark_seam()
    bpy.ops.object.mode_set(mode="OBJECT")
    assert np.flatnonzero(part("compat").seam_edges(ob.data)).tolist() == [4]
    mask = np.zeros(len(ob.data.edges), bool)
    mask[7] = True
    part("compat").set_seam_edges(ob.data, mask)
    assert [edge.index for edge in ob.data.edges if edge.use_seam] == [7]


def test_faces_selected_in_the_uv_editor_are_found(part):
    """Blender's own operator selects; what is read must agree with it."""
    ob = shapes.grid(3, uv=True)
    shapes.enter("EDIT")
    bm = bmesh.from_edit_mesh(ob.data)
    layer = bm.loops.layers.uv.verify()
    bm.faces.ensure_lookup_table()
    for face in bm.faces:
        chosen = face.index in (2, 5)
        if hasattr(face, "uv_select"):
            face.uv_select = chosen
            for loop in face.loops:
                loop.uv_select_vert = loop.uv_select_edge = chosen
        else:
            for loop in face.loops:
                loop[layer].select = loop[layer].select_edge = chosen
    bmesh.update_edit_mesh(ob.data)
    bpy.ops.object.mode_set(mode="OBJECT")
    found = part("compat").uv_selected_faces(ob.data, "UVMap")
    assert np.flatnonzero(found).tolist() == [2, 5]


def test_fresh_meshes_count_as_selected_in_the_uv_editor(part):
    ob = shapes.grid(3, uv=True)
    for name in (".uv_select_face", ".vs.UVMap"):
        attribute = ob.data.attributes.get(name)
        if attribute:
            ob.data.attributes.remove(attribute)
    assert part("compat").uv_selected_faces(ob.data, "UVMap").all()


def test_blenders_own_attributes_say_what_its_properties_say(part):
    compat = part("compat")
    mesh = shapes.monkey(0).data
    mesh.calc_loop_triangles()
    assert np.array_equal(compat.positions(mesh), [v.co[:] for v in mesh.vertices])
    loops = mesh.loops
    assert compat.corner_vertices(mesh).tolist() == [loop.vertex_index for loop in loops]
    assert compat.corner_edges(mesh).tolist() == [loop.edge_index for loop in loops]
    assert np.array_equal(compat.edge_vertices(mesh), [e.vertices[:] for e in mesh.edges])
    faces = [triangle.polygon_index for triangle in mesh.loop_triangles]
    assert compat.triangle_faces(mesh).tolist() == faces
    points = bpy.data.meshes.new("Points")
    points.from_pydata([(0, 0, 0)], [], [])
    assert compat.edge_vertices(points).shape == (0, 2)


def test_faces_selected_for_the_uv_editor_are_those_and_the_mesh_shows_them(part):
    compat = part("compat")
    ob = shapes.grid(3, uv=True)
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.context.tool_settings.use_uv_select_sync = False
    shapes.select_faces(ob, [0, 1, 2])
    compat.select_uv_faces(ob.data, np.array([2, 5]))
    bpy.ops.object.mode_set(mode="OBJECT")
    assert shapes.selected(ob, "face") == [0, 1, 2, 5]
    assert np.flatnonzero(compat.uv_selected_faces(ob.data, "UVMap")).tolist() == [2, 5]


def test_edges_marked_as_sharp_are_read(part):
    ob = shapes.grid(2)
    assert not part("compat").sharp_edges(ob.data).any()
    ob.data.edges[3].use_edge_sharp = True
    assert np.flatnonzero(part("compat").sharp_edges(ob.data)).tolist() == [3]


def test_new_materials_have_nodes(part):
    material = bpy.data.materials.new("Nodes")
    part("compat").use_nodes(material)
    assert material.node_tree is not None and len(material.node_tree.nodes) > 0
    bpy.data.materials.remove(material)
