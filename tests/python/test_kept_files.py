"""Files that get a new map keep all else that they have: only texture coordinates are new."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import flipfree as ff

from surfaces import bumpy_grid

OBJ = """# made by hand
mtllib rich stuff.mtl
o Cube
v 0 0 0 0.1 0.2 0.3
v 1 0 0 1 0 0
v 1 1 0 0 1 0
v 0 1 0 0 0 1
vn 0 0 1
vt 0 0
vt 1 0
vt 1 1
vt 0.5 0.25 0

g left  side
usemtl red
s 1
f 1/1/1 2/2/1 3/3/1 4/4/1   # a quad
o Second
v 2 0 1
v 3 0 1
v 3 1 1
usemtl blue
s off
f -3//-1 -2//-1 \\
  -1//-1
l 5/4 6/2
p 7
"""


def flat(mesh: ff.MeshFile) -> np.ndarray:
    """A map that nobody takes for the old one."""
    return mesh.vertices[mesh.faces][:, :, :2] * 0.125 + 0.5


def rewritten(tmp_path: Path, name: str, content: bytes) -> tuple[ff.MeshFile, bytes]:
    """The mesh that was read, and the file with its flat map."""
    source, target = tmp_path / name, tmp_path / f"new_{name}"
    source.write_bytes(content)
    mesh = ff.read(source)
    ff.write(target, replace(mesh, uv=flat(mesh)), keep=source)
    back = ff.read(target)
    assert np.array_equal(back.vertices, mesh.vertices)
    assert np.array_equal(back.faces, mesh.faces)
    assert np.array_equal(back.polygons, mesh.polygons)
    assert back.uv is not None and np.array_equal(back.uv, flat(mesh).astype(np.float32))
    return mesh, target.read_bytes()


@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_an_obj_keeps_its_lines_but_for_texture_coordinates(tmp_path: Path, end: str) -> None:
    _, content = rewritten(tmp_path, "rich.obj", OBJ.replace("\n", end).encode())
    lines = content.decode().split(end)
    assert "\n" not in "".join(lines)
    old = [line for line in OBJ.splitlines() if not line.startswith(("vt", "f", "l", "  -1"))]
    assert [line for line in lines if not line.startswith(("vt", "f", "l"))] == [*old, ""]
    faces = [line for line in lines if line.startswith("f")]
    assert faces == ["f 1/1/1 2/2/1 3/3/1 4/4/1 # a quad", "f -3/5/-1 -2/6/-1 -1/7/-1"]
    assert lines.index(faces[0]) > lines.index("s 1") and lines.index("s off") < lines.index(
        faces[1]
    )
    assert [line for line in lines if line.startswith("vt")][7:] == ["vt 0.5 0.25 0", "vt 1 0"]
    assert "l 5/8 6/9" in lines


def test_an_obj_keeps_its_lines_where_it_had_no_map(tmp_path: Path) -> None:
    bare = "".join(line for line in OBJ.splitlines(True) if not line.startswith(("vt", "l")))
    for old, new in (("/1/1", "//1"), ("/2/1", "//1"), ("/3/1", "//1"), ("/4/1", "//1")):
        bare = bare.replace(old, new)
    _, content = rewritten(tmp_path, "bare.obj", bare.encode())
    without = [line for line in content.decode().splitlines() if not line.startswith("vt")]
    assert [line for line in without if line[:2] != "f "] == [
        line for line in bare.splitlines() if line[:2] not in ("f ", "  ")
    ]


def test_a_map_that_is_left_out_leaves_all_else(tmp_path: Path) -> None:
    source = tmp_path / "rich.obj"
    source.write_text(OBJ)
    ff.write(tmp_path / "bare.obj", replace(ff.read(source), uv=None), keep=source)
    text = (tmp_path / "bare.obj").read_text()
    assert "f 1//1 2//1 3//1 4//1 # a quad" in text and "f -3//-1 -2//-1 -1//-1" in text
    assert ff.read(tmp_path / "bare.obj").uv is None


@pytest.mark.parametrize("ending", ["obj", "ply"])
def test_maps_that_add_vertices_leave_the_other_polygons(tmp_path: Path, ending: str) -> None:
    vertices, faces = bumpy_grid(3, 3)
    quads = faces.reshape(-1, 6)[:, [0, 1, 2, 5]]
    assert all(len(set(q)) == 4 for q in quads.tolist())
    if ending == "obj":
        lines = [
            f"v {x!r} {y!r} {z!r} 0.{i % 9} 0 1" for i, (x, y, z) in enumerate(vertices.tolist())
        ]
        for i, q in enumerate(quads + 1):
            lines += [f"usemtl m{i}", "f " + " ".join(map(str, q))]
        content = ("\ufeff" + "\n".join(lines)).encode()
    else:
        head = f"ply\nformat ascii 1.0\nelement vertex {len(vertices)}\nproperty double x\nproperty double y\n"
        head += f"property double z\nproperty uchar red\nelement face {len(quads)}\n"
        head += "property list uchar uchar vertex_indices\nproperty int material\nend_header\n"
        rows = [f"{x!r} {y!r} {z!r} {i}" for i, (x, y, z) in enumerate(vertices.tolist())]
        rows += [f"4 {' '.join(map(str, q))} {i}" for i, q in enumerate(quads)]
        content = (head + "\n".join(rows)).encode()
    source, target = tmp_path / f"grid.{ending}", tmp_path / f"map.{ending}"
    source.write_bytes(content)
    mesh = ff.read(source)
    places = {v: (float(x), float(y)) for v, (x, y) in enumerate(mesh.vertices[:, :2])}
    places |= {5: places[10], 10: places[5]}
    found = ff.match(mesh.vertices, mesh.faces, points=places)
    assert len(found.vertices) > len(vertices)
    ff.write(target, found, keep=source)
    back = ff.read(target)
    assert np.array_equal(back.vertices, found.vertices)
    assert back.uv is not None
    certificate = ff.certify(back.vertices, back.faces, back.uv)
    assert certificate.ok and certificate.triangles == len(found.faces)
    assert certificate.energy == pytest.approx(found.certificate.energy)

    triangles = np.bincount(mesh.polygons[found.parent_face])
    expected = [1 if count == 2 else count for count in triangles]
    text = target.read_text()
    if ending == "obj":
        runs = text.split("usemtl ")[1:]
        assert [run.count("f ") for run in runs] == expected
        assert [int(run.splitlines()[0][1:]) for run in runs] == list(range(len(quads)))
        colours = [line.split()[4:] for line in text.splitlines() if line[:2] == "v "]
        assert all(
            len(colour) == 3 and colour[1:] in (["0", "1"], ["0.0", "1.0"]) for colour in colours
        )
    else:
        rows = [row.split() for row in text.partition("end_header\n")[2].splitlines()]
        material = [
            int(row[-1 if len(row) == 0 else 1 + int(row[0])]) for row in rows[len(back.vertices) :]
        ]
        assert np.bincount(material).tolist() == expected
        assert all(0 <= int(row[3]) <= len(vertices) for row in rows[: len(back.vertices)])


def test_what_is_kept_is_of_the_same_mesh_and_type(tmp_path: Path) -> None:
    source = tmp_path / "rich.obj"
    source.write_text(OBJ)
    mesh = ff.read(source)
    mapped = replace(mesh, uv=flat(mesh))
    torn = flat(mesh)
    torn[1, 2, 0] = np.nan
    for path, one, keep, words in (
        ("a.ply", mapped, source, "of the type of path"),
        ("a.obj", replace(mapped, vertices=mesh.vertices + 1), source, "has another mesh"),
        ("a.obj", (mesh.vertices, mesh.faces[:2], flat(mesh)[:2]), source, "has another mesh"),
        ("a.obj", mapped, tmp_path / "nowhere.obj", "cannot be read"),
        ("a.obj", mapped, 7, "must be the path"),
        (
            "a.obj",
            replace(mesh, uv=torn),
            source,
            "Face 1 has a texture coordinate that is not finite",
        ),
    ):
        with pytest.raises(ff.InvalidInput, match=words):
            ff.write(tmp_path / path, one, keep=keep)
    assert [path.name for path in tmp_path.iterdir()] == ["rich.obj"]


def test_a_polygon_that_the_map_tears_becomes_triangles_in_its_place(tmp_path: Path) -> None:
    source, target = tmp_path / "rich.obj", tmp_path / "torn.obj"
    source.write_text(OBJ)
    mesh = ff.read(source)
    uv = flat(mesh)
    uv[1] += 0.25
    ff.write(target, replace(mesh, uv=uv), keep=source)
    back = ff.read(target)
    assert back.uv is not None and np.array_equal(back.uv, uv.astype(np.float32))
    assert np.array_equal(back.faces, mesh.faces)
    run = target.read_text().partition("s 1\n")[2].partition("\no Second")[0]
    assert len(run.splitlines()) == 2
