"""Read and write: meshes with texture coordinates in OBJ, PLY, OFF and STL files."""

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np

from .. import _native, checks, errors
from ..job import ours_only
from ..results import FloatArray, IntArray, Parametrization
from ..rewriting import NewMap, rewritten_obj, rewritten_ply
from ..separated import edge_keys, sides
from ..texts import counted


@dataclass(frozen=True, eq=False)
class MeshFile:
    """A mesh as it stands in a file: whether a map can be made of it, the functions that make maps say.

    Attributes:
        vertices: (n, 3) float64, as written.
        faces: (m, 3) int32; polygons as triangles that lie where they lie, concave ones too.
        uv: (m, 3, 2) float64, one per face corner: 32-bit numbers, as UVs are stored. NaN at faces without; None if no
            face has any.
        polygons: (m,) int32, ascending: the file's polygon that each triangle is part of.
        corners: (m, 3) int32, which of the file's corners each is, counted through its polygons: what makes polygons of
            triangles again. None: triangles are all there is.
    """

    vertices: FloatArray
    faces: IntArray
    uv: FloatArray | None
    polygons: IntArray
    corners: IntArray | None = None

    def seams(self) -> IntArray:
        """(s, 2) edges on whose two sides the texture coordinates differ: the ``cuts`` of :func:`unwrap` that keep the
        file's charts."""
        if self.uv is None:
            return np.zeros((0, 2), np.int32)
        ends, places = sides(self.faces), sides(self.uv)
        backward = ends[:, 0] > ends[:, 1]
        places[backward] = places[backward, ::-1]
        _, first, edge = np.unique(edge_keys(ends), return_index=True, return_inverse=True)
        known = places[first[edge]]
        same = (places == known) | (np.isnan(places) & np.isnan(known))
        differing = np.unique(edge[~same.all(axis=(1, 2))])
        return np.sort(ends[first[differing]], axis=1)


def as_path(path: Any) -> Path:
    try:
        text = os.fspath(path)
    except Exception:  # not a path, or one that fails
        text = None
    if not isinstance(text, str) or not text or "\0" in text:
        raise errors.bad_option(f"path must be the path of a file, not {checks.shown(path)}.")
    return Path(text)


@contextmanager
def _named(path: Path) -> Iterator[None]:
    """Complaints about a file's content say which file."""
    try:
        yield
    except errors.InvalidInput as error:
        raise errors.bad_file(f"{path}: {error}", error.kind, error.elements) from None


def not_accessible(path: Path, doing: str, error: Exception) -> errors.InvalidInput:
    reason = getattr(error, "strerror", None) or error
    return errors.no_access(
        f"{path} cannot be {doing}: {reason}. Check the path and its permissions."
    )


def content_of(file: Path) -> bytes:
    try:
        if file.exists() and not file.is_file():
            raise errors.no_access(f"{file} is not a file. Give the path of one.")
        return file.read_bytes()
    except OSError as error:
        raise not_accessible(file, "read", error) from error


def _mesh_of(file: Path, content: bytes) -> MeshFile:
    with _named(file):
        vertices, faces, polygons, corners, uv = _native.read_mesh(os.fsencode(file), content)
    corner_uv = uv.astype(np.float64).reshape(-1, 3, 2) if len(uv) else None
    return MeshFile(vertices, faces, corner_uv, polygons, corners)


@ours_only
def read(path: str | os.PathLike[str]) -> MeshFile:
    """The mesh of an .obj, .ply, .off or .stl file.

    Faces stay as they are, also where no surface has such ones. Positions keep all their digits. OBJ and PLY have texture
    coordinates per face corner (in PLY the list ``texcoord``) or per vertex, OFF per vertex (STOFF). Materials, groups, normals,
    colours and lines are passed over. STL names no vertices: equal corners become one vertex.

    Raises:
        InvalidInput: the file cannot be read (code "file not accessible"), or is no such file (code "malformed file"); the
            message names the line or element, and what to do.
    """
    file = as_path(path)
    return _mesh_of(file, content_of(file))


@ours_only
def write(
    path: str | os.PathLike[str], mesh: Any, *, keep: str | os.PathLike[str] | None = None
) -> None:
    """Writes an .obj, .ply, .off or .stl file, whole or not at all.

    Texture coordinates are written as the 32-bit numbers that are stored, with all their digits, so that a certificate holds
    for the file too; so are positions, but for STL, whose numbers have 32 bits.

    Args:
        path: of the file; what is there is replaced.
        mesh: a Parametrization, of which ``uv32()`` is written; or a MeshFile, whose polygons are joined again; or
            (vertices, faces) or (vertices, faces, uv) with uv (m, 3, 2).
        keep: the .obj or .ply file that the mesh was read from, of the same type as ``path``. All that it has besides
            texture coordinates is in the new file too: polygons, materials, groups, normals, colours, comments, and
            whatever else. Polygons to which the map adds vertices, or which it tears, become triangles at their places.

    Raises:
        InvalidInput: also for texture coordinates in formats that have none for corners (.off, .stl), where ``keep`` has
            another mesh, and where the file cannot be written (code "file not accessible").
    """
    file = as_path(path)
    vertices, faces, uv, polygons, corners = _parts(mesh)
    face_array = checks.as_indices(faces, "faces", 3)
    positions = checks.as_floats(vertices, "vertices", 3)
    if face_array.size and not (0 <= face_array.min() and face_array.max() < len(positions)):
        raise errors.out_of_range(
            f"faces has an index that is none of the {counted(len(positions), 'vertex', 'vertices')}. Correct it."
        )
    if not np.isfinite(positions).all():
        raise errors.not_finite(
            "vertices has a coordinate that is NaN or infinite. Delete or move it."
        )
    corner_uv = np.zeros((0, 2)) if uv is None else checks.as_corner_uv(uv, "uv", len(face_array))
    checks.refuse_beyond_storage(corner_uv, "uv")
    polygons = checks.as_face_numbers(polygons, "polygons", len(face_array))
    own_corners = checks.as_optional_indices(corners, "corners", 3)
    if corners is not None and len(own_corners) != len(face_array):
        raise errors.bad_shape("corners must have one row per face.")
    if keep is not None:
        found = mesh if isinstance(mesh, Parametrization) else None
        content = _kept(as_path(keep), file, found, (positions, face_array, corner_uv))
    else:
        with _named(file):
            stored = corner_uv.astype(np.float32)
            mesh_arrays = positions, face_array, polygons, own_corners, stored
            content = _native.write_mesh(os.fsencode(file), *mesh_arrays)
    write_whole(file, content)


def _kept(source: Path, file: Path, found: Parametrization | None, arrays: Any) -> bytes:
    """The content of ``source`` with a map. arrays: its vertices, faces and texture coordinates (3 m, 2); none: without any."""
    vertices, faces, corner_uv = arrays
    ending = file.suffix.lower()
    if source.suffix.lower() != ending or ending not in _REWRITERS:
        raise errors.bad_option(
            f"keep must be a file of the type of path, .obj or .ply, not {source.name} for {file.name}. Leave it out."
        )
    content = content_of(source)
    old = _mesh_of(source, content)
    parent = np.arange(len(faces), dtype=np.int32) if found is None else found.parent_face
    count = len(old.vertices)
    if (
        not np.array_equal(vertices[:count], old.vertices)
        or (len(faces) and not 0 <= parent.min() <= parent.max() < len(old.faces))
        or (found is None and (len(vertices) != count or len(faces) != len(old.faces)))
    ):
        raise errors.bad_option(
            f"keep names {source}, which has another mesh. Give the file that the mesh was read from."
        )
    origins, weights = np.zeros((0, 3), np.int32), np.zeros((0, 3))
    if found is not None:
        origins = old.faces[found.vertex_parent[count:]]
        weights = found.vertex_barycentric[count:]
    if len(corner_uv) == 0:
        corner_uv = np.full((3 * len(faces), 2), np.nan)
    uv = corner_uv.astype(np.float32).reshape(-1, 3, 2)
    is_known = np.isfinite(uv).all(axis=(1, 2)) | np.isnan(uv).all(axis=(1, 2))
    odd = np.flatnonzero(~is_known)
    if len(odd):
        raise errors.bad_file(
            f"Face {odd[0]} has a texture coordinate that is not finite. Unwrap it again, or leave uv out.",
            "face",
            odd[:1].tolist(),
        )
    own = _own_vertices(faces, old.faces[parent], vertices)
    assert old.corners is not None
    of_file = old.faces, old.polygons, old.corners
    new = NewMap(*of_file, own, uv, parent, vertices[count:], origins, weights)
    return _REWRITERS[ending](content, new)


_REWRITERS = {".obj": rewritten_obj, ".ply": rewritten_ply}


def _own_vertices(faces: IntArray, parents: IntArray, vertices: FloatArray) -> IntArray:
    """Faces with the vertices of their parents (m, 3), where they have others at the same places: those of merged ones."""
    found = faces.copy()
    row, corner = np.nonzero((faces[:, :, None] != parents[:, None, :]).all(axis=2))
    there = vertices[parents[row]] == vertices[faces[row, corner]][:, None, :]
    same = there.all(axis=2)
    known = same.any(axis=1)
    chosen = parents[row, same.argmax(axis=1)]
    found[row[known], corner[known]] = chosen[known]
    return found


def _parts(mesh: Any) -> list[Any]:
    """Vertices, faces, uv, polygons (m,) and corners (m, 3), None where there are none."""
    if isinstance(mesh, MeshFile):
        return [mesh.vertices, mesh.faces, mesh.uv, mesh.polygons, mesh.corners]
    if isinstance(mesh, Parametrization):
        mesh = mesh.vertices, mesh.faces, mesh.uv32()
    try:
        parts = list(islice(iter(mesh), 4))
    except Exception:  # it has no parts
        parts = []
    if len(parts) in (2, 3):
        return [*parts, None, None, None][:5]
    raise errors.bad_shape(
        "write takes a Parametrization, a MeshFile, (vertices, faces) or (vertices, faces, uv)."
    )


def write_whole(file: Path, content: bytes) -> None:
    """Writes beside the file first, so that a full disk does not cost what is there."""
    beside = None
    try:
        target = file.resolve()
        if target.exists() and not target.is_file():
            raise errors.no_access(f"{file} is not a file. Give the path of one.")
        part = target.with_name(f".{target.name}.{os.getpid()}.part")
        with part.open("xb") as stream:  # no other thread's, and no link
            beside = part
            stream.write(content)
        part.replace(target)
    except (OSError, RuntimeError) as error:  # RuntimeError: links in a circle, before Python 3.13
        raise not_accessible(file, "written", error) from error
    finally:
        if beside is not None:
            with suppress(OSError):
                beside.unlink()
