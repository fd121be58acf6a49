"""Files with single elements that have no meaning, or an odd one: all others are mapped, and they stay in the output."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from commands import run

import flipfree as ff

pytestmark = pytest.mark.usefixtures("here")


ODD = """v 0 0 0
v 1 0 0
v 1 1 0
v 0 1 0
v 2 0 0
v 2 1 0
vt 0 0
vt nan 0
f 1/1 2/9 3/1 4/1
usemtl lines
f 1/1 2/7
f 2 5 5 6 3
"""


THIN = "faces without area, or thinner than 1e-8 of their length"


@pytest.mark.parametrize(("end", "more"), [("", {}), ("f 3/1 6/2 4\n", {THIN: 1}), ("f 6\n", {})])
def test_one_odd_element_refuses_no_file(end: str, more: dict[str, int]) -> None:
    Path("odd.obj").write_text(ODD + end)
    record = run("unwrap", "odd.obj", "--out", "unwrap")
    assert record["status"] == "certified" and record["written"], record
    assert record["certificate"]["mends"] == {"faces that use a vertex twice": 1, **more}
    lines = Path("unwrap/odd.obj").read_text().splitlines()
    assert [line for line in lines if line[0] in "vu" and line[:2] != "vt"] == [
        line for line in ODD.splitlines() if line[0] in "vu" and line[:2] != "vt"
    ]
    words = [line.split()[1:] for line in lines if line[0] == "f"]
    given = [line.split()[1:] for line in (ODD + end).splitlines() if line[0] == "f"]
    assert [[w.split("/")[0] for w in face] for face in words] == [
        [w.split("/")[0] for w in face] for face in given
    ]
    assert words[1] == ["1", "2"]
    assert all("/" in w for face in words if len(face) > 2 for w in face)
    refused = run("pack", "odd.obj", "--out", "pack")
    assert refused["status"] == "refused" and "no texture coordinates" in refused["message"]


@pytest.mark.parametrize("order", ["ascii", "binary_big_endian"])
def test_odd_faces_of_a_ply_stay_with_their_properties(order: str) -> None:
    head = f"ply\nformat {order} 1.0\nelement vertex 4\nproperty float x\nproperty float y\n"
    head += "property float z\nelement face 4\nproperty list uchar uchar vertex_indices\n"
    head += "property list uchar float texcoord\nproperty uchar tag\nend_header\n"
    points = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]
    faces = [([0, 1], 7), ([0, 1, 2], 8), ([], 9), ([0, 2, 3], 10)]
    if order == "ascii":
        rows = [" ".join(map(str, p)) for p in points]
        rows += [" ".join(map(str, [len(f), *f, 0, tag])) for f, tag in faces]
        body = "\n".join(rows).encode()
    else:
        body = np.array(points, ">f4").tobytes()
        body += b"".join(bytes([len(f), *f, 0, tag]) for f, tag in faces)
    Path("odd.ply").write_bytes(head.encode() + body)
    mesh = ff.read("odd.ply")
    assert mesh.polygons.tolist() == [1, 3]
    ff.write(
        "new.ply", (mesh.vertices, mesh.faces, mesh.vertices[mesh.faces][:, :, :2]), keep="odd.ply"
    )
    back = ff.read("new.ply")
    assert back.polygons.tolist() == [1, 3]
    assert back.uv is not None and (back.uv == mesh.vertices[mesh.faces][:, :, :2]).all()
    content = Path("new.ply").read_bytes().partition(b"end_header\n")[2]
    if order == "ascii":
        lines = content.decode().splitlines()[4:]
        assert [lines[0], lines[2]] == ["2 0 1 0 7", "0 0 9"]
        assert [line.split()[-1] for line in lines] == ["7", "8", "9", "10"]
    else:
        assert content[48:53] == bytes([2, 0, 1, 0, 7]) and content[-1] == 10
