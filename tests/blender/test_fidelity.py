# SPDX-License-Identifier: GPL-3.0-or-later
"""What a mesh carries beside its map survives every operator: untouched where nothing is added, interpolated where it is."""

import bpy
import numpy as np
import pytest
import rich
import shapes
from test_refine import split


def refine(part, ob, mode, edges):
    """Halves one diagonal, and these edges; returns what the solver is said to have found."""
    shapes.enter(mode)
    snapshot = part("meshes.mesh_io").read(ob, only_selected=False)
    result = split(snapshot, {tuple(sorted(snapshot.diagonals[0].tolist())), *edges})
    assert part("meshes.refine").needs_new_faces(snapshot, result)
    written = part("meshes.refine").write(ob, snapshot, result, mark_cuts=False)
    assert written == 1 + len(edges)
    bpy.ops.object.mode_set(mode="OBJECT")
    return result


@pytest.fixture(params=["OBJECT", "EDIT"])
def refined(request, part):
    """A sheet that carries everything, one diagonal and two edges between faces halved; values of its edges and faces before."""
    ob = rich.mesh(4)
    edges, faces = element_values(ob, "EDGE"), element_values(ob, "FACE")
    result = refine(part, ob, request.param, [(12, 17), (6, 7)])
    return ob, edges, faces, result


def element_values(ob, domain):
    """[(places of the corners, {name: value} of all attributes)] of each edge or face."""
    mesh = ob.data
    points = np.array([v.co for v in mesh.vertices])
    columns = {
        a.name: rich.values(a)
        for a in mesh.attributes
        if a.domain == domain and not a.name.startswith(".") and "select" not in a.name
    }
    return [
        (
            points[list(one.vertices)],
            {name: values[one.index].tolist() for name, values in columns.items()},
        )
        for one in (mesh.edges if domain == "EDGE" else mesh.polygons)
    ]


def test_uvs_are_the_results_bit_for_bit(refined):
    ob, *_, result = refined
    uv = shapes.uv_of(ob)
    expected = {}
    for face, values in zip(result.faces, result.uv32(), strict=True):
        expected |= {v: value.tobytes() for v, value in zip(face.tolist(), values, strict=True)}
    for loop in ob.data.loops:
        assert uv[loop.index].tobytes() == expected[loop.vertex_index]
    assert sum(p.area for p in ob.data.polygons) == pytest.approx(4.0, rel=1e-3)
    assert not [e for e in ob.data.edges if e.is_loose]


def test_values_of_vertices_and_corners_are_interpolated(refined):
    ob, *_ = refined
    mesh = ob.data
    assert len(mesh.vertices) == 28
    for attribute in mesh.attributes:
        known = attribute.name.startswith(("POINT", "CORNER", "crease_vert", "bevel_weight_vert"))
        if not known:
            continue
        found = rich.values(attribute)
        expected = rich.linear(rich.places(mesh, attribute.domain))
        # Bytes keep 256 steps, in a curve of their own, in which they are mixed.
        step = 0.03 if attribute.data_type == "BYTE_COLOR" else 1e-4
        for column in found.reshape(len(found), -1).T:
            assert column == pytest.approx(expected, abs=step), attribute.name


def test_groups_maps_and_shapes_are_interpolated(refined):
    ob, *_ = refined
    mesh = ob.data
    expected = rich.linear(rich.places(mesh, "POINT"))
    weights = [ob.vertex_groups["Weight"].weight(v.index) for v in mesh.vertices]
    assert weights == pytest.approx(expected, abs=1e-3)
    assert rich.values(mesh.attributes["Other"]) == pytest.approx(
        rich.places(mesh, "CORNER")[:, :2], abs=1e-4
    )
    blocks = mesh.shape_keys.key_blocks
    for up, basis in zip(blocks["Up"].data, blocks["Basis"].data, strict=True):
        assert up.co.z - basis.co.z == pytest.approx(1.0 + basis.co.x, abs=1e-4)


def test_pieces_of_edges_keep_what_the_edge_carried_and_new_ones_carry_nothing(refined):
    ob, before, *_ = refined
    pieces = 0
    for ends, found in element_values(ob, "EDGE"):
        old = [values for line, values in before if lies_on(ends, line)]
        if old:
            assert {k: v for k, v in found.items() if k in old[0]} == old[0]
            pieces += 1
        else:
            assert not found.get("sharp_edge") and found["crease_edge"] == 0.0
            assert found["bevel_weight_edge"] == 0.0 and not found.get("uv_seam")
    assert pieces == 42, "40 edges, two of them halved"


def lies_on(ends, line):
    start, way = line[0], line[1] - line[0]
    share = (ends - start) @ way / (way @ way)
    off = np.linalg.norm(ends - start - share[:, None] * way, axis=1)
    return bool(off.max() < 1e-5 and share.min() > -1e-5 and share.max() < 1 + 1e-5)


def test_pieces_of_faces_keep_what_the_face_carried(refined):
    ob, _, before, _ = refined
    quads = 0
    for corners, found in element_values(ob, "FACE"):
        middle = corners.mean(axis=0)
        (old,) = [values for outline, values in before if inside(middle, outline)]
        assert found == old
        quads += len(corners) == 4
    assert quads == 16 - 5, "faces where nothing is added stay quads"


def inside(point, outline):
    low, high = outline.min(axis=0), outline.max(axis=0)
    return bool((point[:2] > low[:2]).all() and (point[:2] < high[:2]).all())


def slanted_normals(ob):
    """Custom normals that lean more the further to the right; of vertices, so smooth."""
    mesh = ob.data
    at = rich.places(mesh, "POINT")
    normals = np.column_stack([0.3 * at[:, 0], 0.2 * at[:, 1], np.ones(len(at))])
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    mesh.polygons.foreach_set("use_smooth", np.ones(len(mesh.polygons), bool))
    mesh.normals_split_custom_set_from_vertices(normals.tolist())
    return ob


def corner_normals(mesh):
    found = np.empty((len(mesh.loops), 3), np.float32)
    mesh.corner_normals.foreach_get("vector", found.ravel())
    return found


@pytest.mark.parametrize("mode", ["OBJECT", "EDIT"])
def test_custom_normals_stay_and_are_interpolated(mode, part):
    ob = slanted_normals(shapes.grid(4, bump=0.0, uv=True))
    refine(part, ob, mode, [(12, 17), (6, 7)])
    mesh = ob.data
    assert mesh.has_custom_normals
    at = rich.places(mesh, "CORNER")
    expected = np.column_stack([0.3 * at[:, 0], 0.2 * at[:, 1], np.ones(len(at))])
    expected /= np.linalg.norm(expected, axis=1)[:, None]
    assert np.abs(corner_normals(mesh) - expected).max() < 5e-3


@pytest.mark.parametrize("mode", ["OBJECT", "EDIT"])
def test_custom_normals_stay_where_nothing_is_added(mode):
    ob = slanted_normals(shapes.grid(4, bump=0.3, uv=True))
    before = corner_normals(ob.data)
    shapes.enter(mode)
    assert bpy.ops.uv.flipfree_unwrap() == {"FINISHED"}
    bpy.ops.object.mode_set(mode="OBJECT")
    assert np.abs(corner_normals(ob.data) - before).max() < 1e-4


def test_a_mesh_of_several_users_is_mapped_once_and_stays_shared(part):
    first = rich.mesh(4)
    second = bpy.data.objects.new("Second", first.data)
    bpy.context.scene.collection.objects.link(second)
    second.select_set(True)
    snapshot = part("meshes.mesh_io").read(first, only_selected=False)
    result = split(snapshot, {(12, 17)})
    assert part("meshes.refine").write(first, snapshot, result, mark_cuts=False) == 1
    assert second.data is first.data and len(second.data.vertices) == 26
    assert bpy.ops.uv.flipfree_unwrap() == {"FINISHED"}
    assert second.data is first.data and shapes.exact_flips(first) == 0


@pytest.fixture
def library(tmp_path):
    """A file with one object, and what it is called there."""
    ob = shapes.grid(4, "Linked", uv=True)
    path = tmp_path / "library.blend"
    bpy.data.libraries.write(str(path), {ob}, fake_user=True)
    bpy.data.batch_remove([ob, ob.data])
    yield path
    for lib in list(bpy.data.libraries):
        bpy.data.libraries.remove(lib)


def linked(path):
    with bpy.data.libraries.load(str(path), link=True) as (_, into):
        into.objects = ["Linked"]
    ob = into.objects[0]
    bpy.context.scene.collection.objects.link(ob)
    return shapes.activate(ob)


def test_linked_meshes_are_refused_with_the_reason(library):
    ob = linked(library)
    shapes.refused(ob, "Linked.*another file.*Make Local", bpy.ops.uv.flipfree_unwrap)


def test_meshes_of_library_overrides_are_refused_with_the_reason(library):
    """Blender does not keep changes of an override's geometry: they would be gone with the next load."""
    ob = linked(library).override_create(remap_local_usages=True)
    shapes.activate(ob)
    with pytest.raises(RuntimeError, match="another file.*Make Local"):
        bpy.ops.uv.flipfree_unwrap()
    ob.data.override_create(remap_local_usages=True)
    assert ob.data.override_library is not None
    with pytest.raises(RuntimeError, match="override.*Make Local"):
        bpy.ops.uv.flipfree_unwrap()


def test_made_local_they_are_mapped(library):
    ob = linked(library)
    bpy.ops.object.make_local(type="SELECT_OBDATA")
    ob = bpy.context.object
    assert bpy.ops.uv.flipfree_unwrap() == {"FINISHED"}
    assert shapes.exact_flips(ob) == 0
