"""The package's own reading and writing of meshes inside Blender, which has other C++ libraries loaded than plain Python."""

import numpy as np
import pytest

import flipfree as ff

from surfaces import bumpy_grid


@pytest.mark.parametrize("ending", ["obj", "ply", "off", "stl"])
def test_meshes_come_back_from_files(tmp_path, ending):
    vertices, faces = bumpy_grid(60, 60)
    uv = vertices[faces][:, :, :2] if ending in ("obj", "ply") else None
    ff.write(tmp_path / f"mesh.{ending}", (vertices, faces, uv))
    mesh = ff.read(tmp_path / f"mesh.{ending}")
    assert len(mesh.faces) == len(faces)
    if ending != "stl":
        assert np.array_equal(mesh.vertices, vertices)
        assert np.array_equal(mesh.faces, faces)
    if uv is not None:
        assert np.array_equal(mesh.uv, uv.astype(np.float32))
        assert ff.certify(mesh.vertices, mesh.faces, mesh.uv).ok


def test_bad_files_are_refused(tmp_path):
    (tmp_path / "bad.obj").write_text("v 0 0 0\nf /1 2 3\n")
    with pytest.raises(ff.InvalidInput, match="Line 2"):
        ff.read(tmp_path / "bad.obj")
