"""Meshes in files: what a certificate says of a map holds for the file, and nothing else is promised than what is kept."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import flipfree as ff

from hostile_values import VALUES
from surfaces import bumpy_grid

SQUARE = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"
PLY = "ply\nformat ascii 1.0\n"
XYZ = "property float x\nproperty float y\nproperty float z\n"
CORNERS = "element face {}\nproperty list int int vertex_indices\nend_header\n"
REFUSED = [
    (
        "obj",
        "Line 5",
        *(SQUARE + line for line in ("f 1 2 0\n", "f 1 2 -5\n", "f /1 2 3\n", "v 1 2\n")),
    ),
    ("obj", "Line 5", *(SQUARE + f"v 1 2 {number}\n" for number in ("nan", "1,5", "1e400"))),
    ("off", "End of the file", "", "OFF\n3 1 0\n0 0 0\n"),
    ("off", "Line 1", "OFF BINARY\n3 1 0\n", "4OFF\n3 1 0\n"),
    ("off", "Line 2", "OFF\n-3 1 0\n"),
    ("off", "Line 4", "OFF\n1 1 0\n0 0 0\n3 0 0 1\n"),
    ("ply", "Line 1", "plx\n"),
    ("ply", "Line 2", "ply\nend_header\n"),
    ("ply", "Line 3", PLY + "property float x\n", PLY + "element vertex -1\n"),
    ("ply", "End of the file", PLY),
    ("ply", "Header", f"{PLY}element vertex 1\n{XYZ}end_header\n0 0 0\n"),
    ("ply", "Face 0", f"{PLY}element vertex 1\n{XYZ}{CORNERS.format(1)}0 0 0\n3 0 0 1\n"),
    # Four thousand millions of what is not there.
    (
        "ply",
        "Vertex 1",
        f"{PLY}element vertex {4 * 10**9}\n{XYZ}{CORNERS.format(4 * 10**9)}1 2 3\n",
    ),
    ("stl", "Start of the file", " " * 80 + "\0\x28\x6b\xee"),
    ("stl", "End of the file", "solid\nfacet\nouter loop\nvertex 0 0 0\n"),
]


@pytest.fixture(scope="module")
def refined() -> ff.Parametrization:
    """A map with vertices of its own."""
    vertices, faces = bumpy_grid(3, 3)
    places = {v: (float(x), float(y)) for v, (x, y) in enumerate(vertices[:, :2])}
    swapped = {5: places[10], 10: places[5]}
    result = ff.match(vertices, faces, points=places | swapped)
    assert len(result.vertices) > len(vertices)
    return result


@pytest.mark.parametrize("ending", ["obj", "ply"])
def test_a_certificate_survives_the_file(
    refined: ff.Parametrization, tmp_path: Path, ending: str
) -> None:
    ff.write(tmp_path / f"map.{ending}", refined)
    back = ff.read(tmp_path / f"map.{ending}")
    assert np.array_equal(back.vertices, refined.vertices)
    assert np.array_equal(back.faces, refined.faces)
    assert back.uv is not None
    assert back.uv.astype(np.float32).tobytes() == refined.uv32().tobytes()
    certificate = ff.certify(back.vertices, back.faces, back.uv)
    assert certificate.ok
    assert certificate.energy == ff.certify(refined.vertices, refined.faces, refined.uv32()).energy


def test_seams_of_a_file_are_cuts_that_keep_its_charts(tmp_path: Path) -> None:
    box = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
    faces = np.array(
        [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1]]
        + [[2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]]
    )
    unwrapped = ff.unwrap(box, faces, seams="given")
    ff.write(tmp_path / "box.obj", unwrapped)
    mesh = ff.read(tmp_path / "box.obj")
    seams = {tuple(sorted(edge)) for edge in mesh.seams().tolist()}
    assert seams == {tuple(sorted(edge)) for edge in unwrapped.cut_edges.tolist()}
    again = ff.unwrap(mesh.vertices, mesh.faces, cuts=mesh.seams(), seams="given")
    assert {tuple(sorted(edge)) for edge in again.cut_edges.tolist()} == seams
    assert len(ff.MeshFile(mesh.vertices, mesh.faces, None, mesh.polygons).seams()) == 0


@pytest.mark.parametrize("first", range(4))
def test_a_quad_with_a_notch_is_split_inside_from_any_first_corner(
    tmp_path: Path, first: int
) -> None:
    arrow = np.roll([[0, 0, 0], [1, 1, 0], [2, 0, 0], [1, 4, 0]], first, axis=0)
    lines = ["v {} {} {}".format(*corner) for corner in arrow]
    (tmp_path / "arrow.obj").write_text("\n".join([*lines, "f 1 2 3 4", ""]))
    mesh = ff.read(tmp_path / "arrow.obj")
    a, b, c = np.moveaxis(mesh.vertices[mesh.faces][:, :, :2], 1, 0)
    assert (np.linalg.det(np.stack([b - a, c - a], 1)) > 0).all() and len(mesh.faces) == 2


def test_plain_arrays_are_written_to_every_format(tmp_path: Path) -> None:
    vertices, faces = bumpy_grid(3)
    for ending in ("obj", "ply", "off", "stl", "OBJ"):
        ff.write(os.fspath(tmp_path / f"mesh.{ending}"), (vertices, faces))
        back = ff.read(os.fspath(tmp_path / f"mesh.{ending}"))
        assert len(back.faces) == len(faces)
        assert back.uv is None
        if ending != "stl":
            assert np.array_equal(back.vertices, vertices)


def test_what_cannot_be_read_is_refused_by_name(tmp_path: Path) -> None:
    (tmp_path / "bad.obj").write_text(SQUARE + "f 1 2 9\n")
    (tmp_path / "folder.obj").mkdir()
    (tmp_path / "mesh.fbx").write_text("")
    for path, code, words in (
        ("bad.obj", "malformed file", "Line 5: a face uses vertex 9, the file has 4"),
        ("missing.obj", "file not accessible", "No such file"),
        ("folder.obj", "file not accessible", "is not a file"),
        ("mesh.fbx", "malformed file", "none of .obj, .ply, .off and .stl"),
    ):
        with pytest.raises(ff.InvalidInput, match=words) as caught:
            ff.read(tmp_path / path)
        assert caught.value.code == code
    with pytest.raises(ff.InvalidInput, match="is not a file"):
        ff.read("/dev/zero")


@pytest.mark.parametrize(("ending", "place", "contents"), [(e, p, c) for e, p, *c in REFUSED])
def test_refusals_name_the_place(
    tmp_path: Path, ending: str, place: str, contents: list[str]
) -> None:
    path = tmp_path / f"mesh.{ending}"
    for content in contents:
        path.write_bytes(content.encode("latin-1"))
        with pytest.raises(ff.InvalidInput, match=rf"mesh.{ending}: {place}: .{{10,}}") as caught:
            ff.read(path)
        assert caught.value.code == "malformed file"


def test_what_other_programs_write_is_read(tmp_path: Path) -> None:
    path = tmp_path / "mesh.obj"
    path.write_bytes(
        b"\xef\xbb\xbf# comment\r\nmtllib /dev/zero\r\no a\r\nv +0.5 0 0 1 0 0\r\nv 1e0 0 0\r\nv 1 1 0\r\n"
        b"vt 0.25\r\nvt 0.1 0.2 0\r\nvt .5 .75\r\nvn 0 0 1\r\nusemtl b\r\ns 1\r\n"
        b"f -3/-3/1 -2/-2/1 \\\r\n -1/-1/1\r\nl 1 2\r\nf 1//1 2//1 3//1 # end\r\n"
    )
    mesh = ff.read(path)
    assert mesh.faces.tolist() == [[0, 1, 2]] * 2 and mesh.vertices[0, 0] == 0.5
    uv = np.array([[0.25, 0], [0.1, 0.2], [0.5, 0.75]], np.float32)
    assert np.array_equal(mesh.uv, [uv, np.full((3, 2), np.nan)], equal_nan=True)
    path = tmp_path / "mesh.off"
    numbers = "3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"
    coloured = "STCOFF # a\n3 1 0\n\n0 0 0 9 9 9 1 0.5 0.25\n1 0 0 9 9 9 1 1 0 # b\n0 1 0 9 9 9 1 0 1\n3 0 1 2 255 0 0\n"
    for content in (numbers, "OFF " + numbers, coloured):
        path.write_text(content)
        mesh = ff.read(path)
        assert mesh.faces.tolist() == [[0, 1, 2]] and mesh.uv is None


def test_stl_is_read_as_text_and_binary(tmp_path: Path) -> None:
    path = tmp_path / "mesh.stl"
    facet = "facet normal 0 0 1\n outer loop\n  vertex {}\n  vertex {}\n  vertex {}\n endloop\nendfacet\n"
    places = (("0 0 0", "1 0 0", "0 1 0"), ("1 0 0", "1 1 0", "0 1 0"), ("1 0 0", "1 0 0", "0 1 0"))
    text = " solid vertex 1\n" + "".join(facet.format(*corners) for corners in places)
    path.write_text(text + "endsolid\n\n")
    mesh = ff.read(path)
    assert len(mesh.vertices) == 4
    assert len(mesh.faces) == 2  # the third has two corners in one place
    ff.write(path, mesh)
    binary = path.read_bytes()
    assert len(binary) == 84 + 2 * 50
    assert np.array_equal(ff.read(path).faces, mesh.faces)
    for content in (binary[:150], text.encode()):
        path.write_bytes(content)
        with pytest.raises(ff.InvalidInput):
            ff.read(path)


def test_what_cannot_be_written_is_refused_and_the_old_file_stays(tmp_path: Path) -> None:
    vertices, faces = bumpy_grid(2)
    uv = np.random.default_rng(0).random((len(faces), 3, 2))
    file = tmp_path / "mesh.stl"
    file.write_text("old")
    for mesh, words in (
        ((vertices, faces, uv), "Write .obj or .ply"),
        ((vertices[:3], faces), "index"),
        ((vertices * np.nan, faces), "NaN"),
        ((vertices, faces, uv * 1e300), "Scale it down"),
        ((vertices * 1e300, faces), "Scale the mesh down"),
        ((vertices,), "write takes"),
    ):
        with pytest.raises(ff.InvalidInput, match=words):
            ff.write(file, mesh)
    assert file.read_text() == "old"
    uv[1, 2, 0] = np.nan
    with pytest.raises(ff.InvalidInput, match="Face 1 has a texture coordinate that is not finite"):
        ff.write(tmp_path / "mesh.obj", (vertices, faces, uv))
    with pytest.raises(ff.InvalidInput, match="cannot be written: No such file"):
        ff.write(tmp_path / "missing" / "mesh.obj", (vertices, faces))
    assert [path.name for path in tmp_path.iterdir()] == ["mesh.stl"]


@pytest.mark.skipif(os.name != "posix", reason="links want rights")
def test_a_link_keeps_pointing_to_the_file_that_is_written(tmp_path: Path) -> None:
    (tmp_path / "link.obj").symlink_to(tmp_path / "mesh.obj")
    ff.write(tmp_path / "link.obj", bumpy_grid(2))
    assert (tmp_path / "link.obj").is_symlink()
    assert len(ff.read(tmp_path / "mesh.obj").faces) == len(bumpy_grid(2)[1])


def test_truncated_files_are_refused_or_are_a_mesh(tmp_path: Path) -> None:
    mesh = bumpy_grid(3)
    for ending in ("obj", "ply", "off", "stl"):
        path = tmp_path / f"mesh.{ending}"
        ff.write(path, mesh)
        content = path.read_bytes()
        refused = 0
        for size in range(0, len(content) - 2, 7):
            path.write_bytes(content[:size])
            try:
                ff.read(path)
            except ff.InvalidInput as error:
                refused += 1
                assert error.code == "malformed file"
        assert refused > (0 if ending == "obj" else 30)


@pytest.mark.parametrize("described", VALUES)
def test_unexpected_arguments_are_taken_or_refused(described: str, tmp_path: Path) -> None:
    value: Any = VALUES[described]()
    good = (np.eye(3), np.array([[0, 1, 2]]))
    for call in (
        lambda: ff.read(value),
        lambda: ff.write(value, good),
        lambda: ff.write(tmp_path / "a.obj", value),
        lambda: ff.write(tmp_path / "a.obj", (value, good[1])),
        lambda: ff.write(tmp_path / "a.obj", (good[0], value)),
        lambda: ff.write(tmp_path / "a.obj", (*good, value)),
    ):
        try:
            call()
        except ff.InvalidInput as error:
            assert error.code not in ("", "internal error", "out of memory"), error
            assert len(str(error)) > 20


@pytest.mark.skipif(os.name != "posix", reason="names are of characters")
@pytest.mark.parametrize("ending", [".obj", ".ply", ".off", ".stl"])
def test_names_that_are_no_utf_8_are_read_and_written(tmp_path, ending):
    path = os.path.join(tmp_path, os.fsdecode(b"caf\xe9" + ending.encode()))
    vertices, faces = np.eye(3), np.array([[0, 1, 2]], np.int32)
    ff.write(path, (vertices, faces))
    assert len(ff.read(path).faces) == 1
    with open(path, "wb") as file:
        file.write(b"secret content")
    if ending == ".obj":
        return  # lines of words that it does not know are passed over
    with pytest.raises(ff.InvalidInput) as caught:
        ff.read(path)
    assert str(caught.value).startswith(path) and "b'" not in str(caught.value)
