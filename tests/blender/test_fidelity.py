# SPDX-License-Identifier: GPL-3.0-or-later
"""What a mesh carries beside its map survives every operator: untouched where nothing is added, interpolated where it is."""

import bpy
import numpy as np
import pytest
import rich
import shapes
from test_refine import split


def run_on_all(ob, mode, call):
    bpy.ops.object.mode_set(mode=mode)
    if mode == "EDIT":
        bpy.ops.mesh.select_all(action="SELECT")
    assert call() == {"FINISHED"}
    bpy.ops.object.mode_set(mode="OBJECT")


@pytest.mark.parametrize("mode", ["OBJECT", "EDIT"])
@pytest.mark.parametrize(
    "name", ["unwrap", "improve", "pack", "conformal", "set_density", "orient"]
)
def test_where_nothing_is_added_only_the_active_map_changes(name, mode):
    ob = rich.mesh(4)
    at = rich.places(ob.data, "CORNER")[:, :2]
    shapes.set_uv(ob, at * [0.3, 0.1] + 0.5)
    before, keys = rich.attributes(ob), shape_keys(ob)
    run_on_all(ob, mode, getattr(bpy.ops.uv, f"flipfree_{name}"))
    after = rich.attributes(ob)
    changed = {key for key in before.keys() | after.keys() if before.get(key) != after.get(key)}
    seams = {"uv_seam", ".uv_seam"}  # the conformal map marks its cuts
    assert "UVMap" in changed and changed <= {"UVMap"} | (seams if name == "conformal" else set())
    assert shape_keys(ob) == keys


def shape_keys(ob):
    found = []
    for block in ob.data.shape_keys.key_blocks:
        at = np.empty(3 * len(block.data), np.float32)
        block.data.foreach_get("co", at)
        found.append((block.name, at.tobytes()))
    return found


@pytest.fixture(params=["OBJECT", "EDIT"])
def refined(request, part):
    """A sheet that carries everything, one diagonal and two edges between faces halved; the lengths of its edges before."""
    ob = rich.mesh(4)
    before = edge_values(ob)
    faces = face_values(ob)
    bpy.ops.object.mode_set(mode=request.param)
    if request.param == "EDIT":
        bpy.ops.mesh.select_all(action="SELECT")
    snapshot = part("meshes.mesh_io").read(ob, only_selected=False)
    diagonal = tuple(sorted(snapshot.diagonals[0].tolist()))
    result = split(snapshot, {diagonal, (12, 17), (6, 7)})
    assert part("meshes.refine").write(ob, snapshot, result, mark_cuts=False) == 3
    bpy.ops.object.mode_set(mode="OBJECT")
    return ob, before, faces


def edge_values(ob):
    """{(midpoint, direction) of each straight edge: values of all edge attributes}, for finding what lies on an old edge."""
    mesh = ob.data
    points = np.array([v.co for v in mesh.vertices])
    names = sorted(
        a.name
        for a in mesh.attributes
        if a.domain == "EDGE" and not a.name.startswith(".") and "select" not in a.name
    )
    columns = {name: rich.values(mesh.attributes[name]) for name in names}
    return [
        (points[list(edge.vertices)], {name: columns[name][edge.index].tolist() for name in names})
        for edge in mesh.edges
    ]


def face_values(ob):
    mesh = ob.data
    points = np.array([v.co for v in mesh.vertices])
    names = sorted(
        a.name
        for a in mesh.attributes
        if a.domain == "FACE" and not a.name.startswith(".") and "select" not in a.name
    )
    columns = {name: rich.values(mesh.attributes[name]) for name in names}
    return [
        (
            points[list(p.vertices)],
            {name: columns[name][p.index].tolist() for name in names}
            | {"smooth": p.use_smooth, "material": p.material_index},
        )
        for p in mesh.polygons
    ]


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
    ob, before, _ = refined
    pieces = 0
    for ends, found in edge_values(ob):
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
    ob, _, before = refined
    quads = 0
    for corners, found in face_values(ob):
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
    bpy.ops.object.mode_set(mode=mode)
    if mode == "EDIT":
        bpy.ops.mesh.select_all(action="SELECT")
    snapshot = part("meshes.mesh_io").read(ob, only_selected=False)
    diagonal = tuple(sorted(snapshot.diagonals[0].tolist()))
    result = split(snapshot, {diagonal, (12, 17), (6, 7)})
    assert part("meshes.refine").write(ob, snapshot, result, mark_cuts=False) == 3
    bpy.ops.object.mode_set(mode="OBJECT")
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
    run_on_all(ob, mode, bpy.ops.uv.flipfree_unwrap)
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
    before = shapes.everything(ob)
    with pytest.raises(RuntimeError, match="Linked.*another file.*Make Local"):
        bpy.ops.uv.flipfree_unwrap()
    assert shapes.everything(ob) == before


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


def test_beside_linked_objects_others_are_mapped(library):
    ob = linked(library)
    other = shapes.grid(4, "Own", uv=True, x=3.0)
    ob.select_set(True)
    before = shapes.everything(ob), shapes.everything(other)
    assert bpy.ops.uv.flipfree_unwrap() == {"FINISHED"}
    assert shapes.everything(ob) == before[0] and shapes.everything(other) != before[1]
