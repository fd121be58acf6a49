# SPDX-License-Identifier: GPL-3.0-or-later
"""Use Modifiers: maps of the surface as modifiers and shape keys deform it."""

import bpy
import numpy as np
import pytest
import shapes
from test_match import SWAP, met, pinned_sheet


def tapered(uv=True):
    """A flat sheet that a modifier makes three times as wide at one end; the mesh itself stays square."""
    ob = shapes.grid(12, bump=0.0, uv=uv)
    modifier = ob.modifiers.new("Taper", "SIMPLE_DEFORM")
    modifier.deform_method, modifier.deform_axis, modifier.factor = "TAPER", "X", 1.0
    return ob


def shaped(ob):
    """(#vertices, 3) as the viewport has them."""
    evaluated = ob.evaluated_get(bpy.context.evaluated_depsgraph_get())
    mesh = evaluated.to_mesh()
    found = np.array([v.co[:] for v in mesh.vertices])
    evaluated.to_mesh_clear()
    return found


def uneven(ob, positions):
    """By how much areas in the map differ, relative to those of the surface with these positions: 1 is not at all."""
    corners, uv = shapes.triangles_of(ob)
    a, b, c = (positions[corners[:, k]] for k in range(3))
    surface = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    p, q = uv[:, 1] - uv[:, 0], uv[:, 2] - uv[:, 0]
    ratio = np.abs(p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0]) / surface
    return float(ratio.max() / ratio.min())


def own(ob):
    return np.array([v.co[:] for v in ob.data.vertices])


@pytest.mark.parametrize("mode", ["OBJECT", "EDIT"])
def test_unwrap_follows_the_deformed_surface(mode):
    ob = tapered()
    if mode == "EDIT":
        ob.modifiers[0].show_in_editmode = True
        shapes.enter("EDIT")
    assert bpy.ops.uv.flipfree_unwrap(use_modifiers=True) == {"FINISHED"}
    if mode == "EDIT":
        bpy.ops.object.mode_set(mode="OBJECT")
    assert uneven(ob, shaped(ob)) < 1.05 and shapes.exact_flips(ob) == 0
    assert uneven(ob, own(ob)) > 2.0
    assert bpy.ops.uv.flipfree_unwrap() == {"FINISHED"}
    assert uneven(ob, own(ob)) < 1.05


def test_shape_keys_count(energy):
    ob = shapes.grid(8, bump=0.0, uv=True)
    ob.shape_key_add(name="Basis")
    key = ob.shape_key_add(name="Key")
    for point in key.data:
        point.co.x *= 4.0
    key.value = 1.0
    assert bpy.ops.uv.flipfree_unwrap(use_modifiers=True) == {"FINISHED"}
    assert energy(bpy.ops.uv.flipfree_check, use_modifiers=True) < 1.001
    assert energy(bpy.ops.uv.flipfree_check) > 2.0


@pytest.fixture
def energy(part):
    """energy(operator): mean distortion that it reports of the active object."""

    def reported(operator, **options):
        assert operator(**options) == {"FINISHED"}
        return part("certificates").of(bpy.context.object).figures["energy"]

    return reported


def test_improve_and_check_measure_the_deformed_surface(energy):
    tapered()
    bpy.ops.uv.flipfree_unwrap()
    plain = energy(bpy.ops.uv.flipfree_check)
    deformed = energy(bpy.ops.uv.flipfree_check, use_modifiers=True)
    assert plain < 1.001 and deformed > 1.05
    assert energy(bpy.ops.uv.flipfree_improve, use_modifiers=True) < 1.01
    assert energy(bpy.ops.uv.flipfree_check, use_modifiers=True) < 1.01
    assert energy(bpy.ops.uv.flipfree_check) > 1.05


def test_a_conformal_map_is_one_of_the_deformed_surface():
    ob = tapered()
    assert bpy.ops.uv.flipfree_conformal(use_modifiers=True) == {"FINISHED"}
    corners, uv = shapes.triangles_of(ob)
    places = shaped(ob)

    def angles(points):
        found = []
        for k in range(3):
            a, b = points[:, (k + 1) % 3] - points[:, k], points[:, (k + 2) % 3] - points[:, k]
            cosine = (a * b).sum(1) / np.linalg.norm(a, axis=1) / np.linalg.norm(b, axis=1)
            found.append(np.arccos(np.clip(cosine, -1, 1)))
        return np.array(found)

    there = np.abs(angles(uv.astype(float)) - angles(places[corners])).mean()
    here = np.abs(angles(uv.astype(float)) - angles(own(ob)[corners])).mean()
    assert there < 0.2 * here


def test_new_vertices_lie_on_the_mesh_as_it_is_without_modifiers():
    ob, uv, corner = pinned_sheet(SWAP)
    for vertex in ob.data.vertices:
        vertex.co.z = 0.0
    modifier = ob.modifiers.new("Cast", "CAST")
    modifier.factor = 0.5
    before = len(ob.data.vertices)
    assert np.abs(shaped(ob)[:, 2]).max() < 1e-6 and not np.allclose(shaped(ob), own(ob))
    assert bpy.ops.uv.flipfree_match(use_modifiers=True) == {"FINISHED"}
    met(ob, SWAP, uv, corner)
    assert len(ob.data.vertices) > before and shapes.exact_flips(ob) == 0
    assert not shapes.edges_with_loose_ends(ob)
    # The square is covered as before: pulled in as the modifier does, it would not be.
    places = own(ob)
    areas = [p.area for p in ob.data.polygons]
    assert abs(sum(areas) - 4.0) < 1e-4 and np.abs(places[:, 2]).max() < 1e-6


@pytest.mark.parametrize("kind", ["SUBSURF", "MIRROR", "BEVEL", "SOLIDIFY", "TRIANGULATE", "MASK"])
def test_modifiers_that_make_other_faces_are_refused_by_name(kind):
    ob = shapes.grid(4, bump=0.2, uv=True)
    if kind == "MASK":
        ob.vertex_groups.new(name="Part").add([0, 1, 5, 6], 1.0, "ADD")
    modifier = ob.modifiers.new("The Culprit", kind)
    if kind == "MASK":
        modifier.vertex_group = "Part"
    if kind == "BEVEL":
        modifier.limit_method = "NONE"
    shapes.refused(
        ob,
        "The Culprit.*Hide such modifiers in the viewport",
        bpy.ops.uv.flipfree_unwrap,
        use_modifiers=True,
    )
    modifier.show_viewport = False  # what the message says
    assert bpy.ops.uv.flipfree_unwrap(use_modifiers=True) == {"FINISHED"}
    modifier.show_viewport = True
    assert bpy.ops.uv.flipfree_unwrap() == {"FINISHED"}


def test_the_other_objects_are_mapped():
    good = tapered()
    other = shapes.grid(4, "Other", uv=True)
    other.modifiers.new("Subdivision", "SUBSURF")
    good.select_set(True)
    before = shapes.everything(other)
    assert bpy.ops.uv.flipfree_unwrap(use_modifiers=True) == {"FINISHED"}
    assert shapes.everything(other) == before and uneven(good, shaped(good)) < 1.05


def test_modifiers_that_are_said_to_keep_faces_do(part):
    modifiers = part("meshes.modifiers")
    for kind in sorted(modifiers.KEEP_FACES):
        ob = shapes.grid(3, uv=True)
        ob.modifiers.new("It", kind)
        assert isinstance(modifiers.positions(ob, ob.data), np.ndarray), kind
        bpy.data.objects.remove(ob)
        bpy.context.view_layer.update()
