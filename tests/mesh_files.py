"""Meshes of benchmarks and tests with their seams, and where the shared data folder is."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

import flipfree as ff

from judges.disjoint_sets import DisjointSets

ROOT = Path(__file__).resolve().parent.parent


def data_folder() -> Path | None:
    """The shared data folder: environment variable FLIPFREE_DATA, else ../shared/data beside the checkout, if there."""
    folder = Path(os.environ.get("FLIPFREE_DATA", ROOT.parent / "shared" / "data"))
    return folder if folder.is_dir() else None


def shared(name: str) -> Path:
    """A file of the shared data folder; the test that asks for it is skipped without."""
    file = (data_folder() or ROOT) / name
    if not file.exists():
        import pytest  # benchmarks have none

        pytest.skip("the shared data folder is not here (FLIPFREE_DATA)")
    return file


@dataclass
class MeshFile:
    vertices: npt.NDArray[np.float64]  # (n, 3)
    faces: npt.NDArray[np.int32]  # (m, 3), polygons fanned
    seams: npt.NDArray[np.int32]  # (s, 2), edges across which the file's texture coordinates differ
    uv: npt.NDArray[np.float64] | None  # (m, 3, 2), the file's texture coordinates


def read_mesh(path: Path | str) -> MeshFile:
    mesh = ff.read(path)
    return MeshFile(mesh.vertices, mesh.faces, mesh.seams(), mesh.uv)


def cut_pieces(
    mesh: MeshFile,
) -> list[tuple[npt.NDArray[np.float64], npt.NDArray[np.int32]]]:
    """Vertices and faces of the pieces that the mesh's seams cut it into; without seams, of the mesh as it is."""
    if len(mesh.seams) == 0:
        return [(mesh.vertices, mesh.faces)]
    corner, piece = cut_corners(mesh.faces, mesh.seams)
    pieces = []
    for p in np.unique(piece):
        used, faces = np.unique(corner[piece == p], return_inverse=True)
        pieces.append(
            (mesh.vertices[mesh.faces.ravel()[used]], faces.reshape(-1, 3).astype(np.int32))
        )
    return pieces


def cut_corners(
    faces: npt.NDArray[np.int32], seams: npt.NDArray[np.integer]
) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]]:
    """(m, 3) a corner 3 face + k for each corner, the same for those that are one vertex once the edges `seams` (s, 2) are
    cut; (m,) a face for each face, the same in one piece."""
    cut = {(min(a, b), max(a, b)) for a, b in seams.tolist()}
    corners, pieces = DisjointSets(faces.size), DisjointSets(len(faces))
    seen: dict[tuple[int, int], tuple[int, int]] = {}
    for f, face in enumerate(faces.tolist()):
        for k in range(3):
            a, b = face[k], face[(k + 1) % 3]
            at_a, at_b = 3 * f + k, 3 * f + (k + 1) % 3
            key = (a, b) if a < b else (b, a)
            low, high = (at_a, at_b) if a < b else (at_b, at_a)
            if key not in seen:
                seen[key] = (low, high)
            elif key not in cut:
                for i, j in zip(seen[key], (low, high), strict=True):
                    corners.join(i, j)
                pieces.join(seen[key][0] // 3, f)
    corner = np.array([corners.find(i) for i in range(faces.size)]).reshape(-1, 3)
    return corner, np.array([pieces.find(f) for f in range(len(faces))])
