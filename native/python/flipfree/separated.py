"""What belongs together in a mesh and in its map, and any triangles as a clean surface for the solvers that want one.

``unwrap``, ``improve``, ``pack`` and ``certify`` do this themselves.
"""

import math
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt

from . import _native
from .checks import as_corner_uv, as_face_numbers, as_indices, as_mesh, as_optional_indices
from .errors import FlipfreeError, InvalidInput, bad_shape
from .job import ours_only
from .results import Array, Flags, FloatArray, IntArray, Mend, Parametrization, Transitions, frozen

Value = TypeVar("Value")
OfCorners = Callable[[Array, Array], Array]


@dataclass(frozen=True, eq=False)
class SeparatedSurface:
    """Every vertex used, faces oriented, manifold, each of three different vertices and with an area.

    Attributes:
        vertices, faces: (n', 3), (m', 3), for any solver. Corners of faces without area are moved by a thousandth of the
            edges around, or less; all others are where they were.
        vertex_origin, face_origin: (n',), (m',), vertex and face of the input.
        turned: (m',) True: the face's corners run 0, 2, 1 of the input's.
        collapsed: input faces that use a vertex twice and so are in no map.
        mends: what was done, empty if the input was clean.
        input_vertices, input_faces: the input.
    """

    vertices: FloatArray
    faces: IntArray
    vertex_origin: IntArray
    face_origin: IntArray
    turned: Flags
    collapsed: IntArray
    mends: tuple[Mend, ...]
    input_vertices: FloatArray
    input_faces: IntArray

    def copies(self, of_vertices: Mapping[int, Value]) -> dict[int, Value]:
        """Values at vertices of the input, such as pins and cones, at every copy of these vertices."""
        return {
            v: of_vertices[o] for v, o in enumerate(self.vertex_origin.tolist()) if o in of_vertices
        }

    def of_vertices(self, values: Array) -> Array:
        """Values (n, ...) at vertices of the input at those of this surface."""
        return values[self.vertex_origin]

    def edges(self, pairs: Any) -> IntArray:
        """(s', 2) edges that come from these (s, 2) vertex pairs of the input, such as seams."""
        wanted = edge_keys(as_indices(pairs, "pairs", 2))
        ends = sides(self.faces)
        chosen = np.isin(edge_keys(self.vertex_origin[ends]), wanted)
        return np.unique(np.sort(ends[chosen], axis=1), axis=0).astype(np.int32)

    def corners(self, values: npt.ArrayLike) -> Array:
        """Values (m, 3, ...) at corners of the input, such as UVs, at those of this surface (m', 3, ...)."""
        given = np.asarray(values)
        if given.shape[:2] != (len(self.input_faces), 3):
            raise bad_shape(
                f"values must have shape ({len(self.input_faces)}, 3, ...), one for each corner of the input."
            )
        return turned_over(given[self.face_origin], self.turned)

    def on_faces(self, faces: Array, weights: FloatArray) -> tuple[Array, FloatArray]:
        """Points in faces of this surface as such in faces of the input."""
        return self.face_origin[faces], turned_over(weights, self.turned[faces])

    def on_input(self, result: Parametrization) -> Parametrization:
        """A solver's result on this surface as a map of the input, whose vertices come first, whether it added vertices or not.

        Faces that use a vertex twice get points of their neighbours. Turned faces have the input's order of corners
        again, which runs clockwise in the map. The certificate is the one of this surface, with ``mends``; transitions
        of seams lead from the face on the left of the edge here.
        """
        arrays, of_corners = self.carried(result)
        at = self._points_of_collapsed(arrays["numbers"][result.faces])

        def with_collapsed(values: Array) -> Any:
            there = np.where((at >= 0)[..., None], values.reshape(-1, 2)[at], 0.0)
            return of_corners(values, there)

        number = arrays.pop("numbers")
        certificate = replace(
            result.certificate,
            mends=self.mends,
            seam_vertices=number[result.certificate.seam_vertices],
        )
        return replace(
            result,
            **arrays,
            uv=with_collapsed(result.uv),
            uv64=with_collapsed(result.uv64),
            _uv32=with_collapsed(result.uv32()),
            certificate=certificate,
            input_faces=self.input_faces,
            log_weight=None,
        )

    def carried(self, result: Any) -> tuple[dict[str, Any], OfCorners]:
        """Of a map of this surface: its faces, vertices, parents and cuts as of the input, and "numbers", what its vertices are
        there; and what does the same with values at its corners (m', 3, ...) and those of ``collapsed`` (k, 3, ...)."""
        old, given = len(self.vertices), len(self.input_vertices)
        added = np.arange(len(result.vertices) - old)
        number = np.concatenate([self.vertex_origin, given + added]).astype(np.int32)
        swapped = self.turned[result.parent_face]
        parent_face = np.concatenate([self.face_origin[result.parent_face], self.collapsed])
        order = np.argsort(parent_face, kind="stable")

        def of_corners(values: Array, others: Array) -> Array:
            mine = turned_over(values, swapped)
            return np.asarray(np.concatenate([mine, others.astype(values.dtype)])[order])

        new_parent = result.vertex_parent[old:]
        weights = result.vertex_barycentric[old:]
        corners = self.input_vertices[self.vertex_origin[self.faces[new_parent]]]
        moved = (corners != self.vertices[self.faces[new_parent]]).any(axis=(1, 2))
        vertices = result.vertices[old:].copy()
        vertices[moved] = np.einsum("vk,vkd->vd", weights[moved], corners[moved])
        first_parent, first_weights = np.full(given, -1, np.int32), np.zeros((given, 3))
        parents, places = self.on_faces(result.vertex_parent, result.vertex_barycentric)
        first_parent[self.vertex_origin] = parents[:old]
        first_weights[self.vertex_origin] = places[:old]
        arrays = {
            "vertices": np.concatenate([self.input_vertices, vertices]),
            "faces": of_corners(number[result.faces], self.input_faces[self.collapsed]),
            "parent_face": parent_face[order],
            "vertex_parent": np.concatenate([first_parent, parents[old:]]),
            "vertex_barycentric": np.concatenate([first_weights, places[old:]]),
            "cut_edges": number[result.cut_edges],
            "numbers": number,
        }
        return arrays, of_corners

    def _points_of_collapsed(self, faces: IntArray) -> IntArray:
        """(k, 3) flat corner of the result at each corner of a face that uses a vertex twice; -1: there is none."""
        any_corner = np.full(len(self.input_vertices), -1, np.int32)
        flat = faces.ravel()
        known = flat < len(self.input_vertices)
        any_corner[flat[known]] = np.flatnonzero(known)
        at = any_corner[self.input_faces[self.collapsed]]
        return np.where(at >= 0, at, at.max(axis=1, keepdims=True, initial=-1))


def edge_keys(pairs: Array) -> Array:
    """A number for each pair (s, 2) of vertices, whichever comes first."""
    wide = pairs.astype(np.int64)
    return np.asarray(wide.min(axis=1) << 32 | wide.max(axis=1))


def sides(faces: Array) -> Array:
    """(3 m, 2) from each corner to the next: all first sides, all second ones, all third ones."""
    return np.concatenate([faces[:, (k, (k + 1) % 3)] for k in range(3)])


def edges_on(faces: IntArray, ends: Array, pairs: Array) -> IntArray:
    """(k, 2) sides of faces that lie on these edges (s, 2) of another mesh. ends: (n, 2) the vertices there between which each
    vertex lies, one of them twice where it is that one, -1 where it lies on no edge."""
    side = np.unique(np.sort(sides(faces), axis=1), axis=0)
    four = np.sort(ends[side].reshape(-1, 4), axis=1)
    low, high = four[:, :1], four[:, 3:]
    fits = ((four == low) | (four == high)).all(axis=1) & ((low >= 0) & (low < high))[:, 0]
    fits &= np.isin(edge_keys(four[:, [0, 3]]), edge_keys(pairs))
    return np.ascontiguousarray(side[fits].astype(np.int32))


def folds(vertices: FloatArray, faces: IntArray, angle: float, within: Any = ()) -> IntArray:
    """(s, 2) edges at which the surface folds by more than that angle, radians, those of the keys ``within`` left out, and
    those of faces without area, which have no normal."""
    corner = vertices[faces]
    normal = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
    ends, face = sides(faces), np.tile(np.arange(len(faces)), 3)
    keys = edge_keys(ends)
    order = np.argsort(keys, kind="stable")
    both = np.flatnonzero(keys[order][1:] == keys[order][:-1])
    left, right = order[both], order[both + 1]
    one, other = normal[face[left]], normal[face[right]]
    bent = np.einsum("ij,ij->i", one, other) < np.cos(angle)
    bent &= one.any(axis=1) & other.any(axis=1)
    chosen = left[bent & ~np.isin(keys[left], within)]
    return np.unique(np.sort(ends[chosen], axis=1), axis=0).astype(np.int32)


def edges_of_quads(faces: IntArray, polygons: IntArray, within: Array) -> IntArray:
    """(s, 2) edges of polygons of two triangles, those of the keys ``within`` left out. polygons: (m,) that of each triangle."""
    pairs = np.sort(sides(faces[np.bincount(polygons)[polygons] == 2]), axis=1)
    pairs = np.unique(pairs, axis=0).astype(np.int32)
    return pairs[~np.isin(edge_keys(pairs), within)]


def in_unit_square(uv: FloatArray) -> FloatArray:
    """uv (m, 3, 2) on a grid, moved and scaled by a power of two so that its box lies in the unit square, at the origin:
    nothing is rounded."""
    low = uv.min(axis=(0, 1))
    extent = float((uv.max(axis=(0, 1)) - low).max())
    return np.asarray((uv - low) * 2.0 ** -math.ceil(math.log2(extent)))


def boundary_loops(faces: IntArray) -> list[list[int]]:
    """Vertices of each loop of a manifold surface's boundary in order, the surface on the left, from its smallest vertex on."""
    ends = np.stack([faces, np.roll(faces, -1, axis=1)], -1).reshape(-1, 2).tolist()
    inner = {(b, a) for a, b in ends}
    follow = {a: b for a, b in ends if (a, b) not in inner}
    loops = []
    for at in sorted(follow):
        if at in follow:
            loops.append([at])
            while (at := follow.pop(at)) in follow:
                loops[-1].append(at)
    return loops


def turned_over(values: Array, turned: Flags) -> Array:
    """(m, 3, ...) with the second and third of each of these rows in the other order."""
    result = values.copy()
    result[turned, 1], result[turned, 2] = values[turned, 2], values[turned, 1]
    return result


@ours_only
def separate(
    vertices: Any, faces: Any, *, seams: Any = None, materials: Any = None, polygons: Any = None
) -> SeparatedSurface:
    """A clean surface of any triangles, with the way back: see docs/method/unwrap.md.

    Args:
        vertices: (n, 3). faces: (m, 3), in any order and winding, as many at an edge as there are.
        seams: (s, 2) vertex pairs. Where more than two faces meet at one, none of them continues another.
        materials: (m,) whole numbers: where more than two faces meet, those of one material rather go together.
        polygons: (m,) whole numbers: triangles of one polygon, which has one UV per corner, are parted only where the polygon
            itself meets an edge twice.

    Raises:
        InvalidInput for what has no meaning: no faces, indices out of range, coordinates that are not finite, and where
        every face uses a vertex twice.

    Linear.
    """
    mesh = as_mesh(vertices, faces)
    count = len(mesh.faces)
    rest, triangles, vertex_origin, face_origin, turned, collapsed, mends = _native.separate(
        mesh.scaled,
        mesh.faces,
        as_optional_indices(seams, "seams", 2),
        as_face_numbers(materials, "materials", count),
        as_face_numbers(polygons, "polygons", count),
    )
    if len(triangles) == 0:
        raise InvalidInput(
            "Every face uses a vertex twice, so that there is nothing to map. Delete degenerate faces.",
            code="face uses a vertex twice",
        )
    moved = (rest != mesh.scaled[vertex_origin]).any(axis=1)
    placed = mesh.given[vertex_origin]
    placed[moved] = np.ldexp(rest[moved], mesh.exponent)
    arrays = (placed, triangles, vertex_origin, face_origin, turned.astype(bool), collapsed)
    told = tuple(Mend(*mend) for mend in mends)
    return SeparatedSurface(*frozen(arrays), told, mesh.given, mesh.faces)


@ours_only
def split_fans(faces: Any, *, cuts: Any = None) -> tuple[IntArray, IntArray]:
    """Renumbers triangles so that every fan of edge-connected triangles around a point has a vertex of its own.

    Args:
        faces: (m, 3). All triangles of an edge count as connected, however many they are and whichever way they run.
        cuts: (s, 2) vertex pairs; these edges connect nothing. Pairs that are no edge are ignored.

    Returns:
        (faces (m, 3) over the new vertices, (n,) the old vertex of each). Vertices keep their order, fans of one vertex
        the order of their first triangles; vertices without triangles are left out. Linear, 0.1 s for two million triangles.
    """
    triangles, origin = _native.split_fans(
        as_indices(faces, "faces", 3), as_optional_indices(cuts, "cuts", 2)
    )
    return triangles, origin


@ours_only
def islands(faces: Any, uv: Any = None) -> tuple[IntArray, int]:
    """Which faces make an island: those that share an edge and the UVs at both its ends, bit for bit as 32-bit floats.

    Args:
        faces: (m, 3), any triangles, whichever way they run. uv: (m, 3, 2), one per face corner; None: a common edge is enough.

    Returns:
        ((m,) the smallest face of each face's island, how many edges have sides that differ in the last bits only, which were
        never meant to be cuts). Linear, 0.2 s for two million triangles.
    """
    triangles = as_indices(faces, "faces", 3)
    places = None
    if isinstance(uv, np.ndarray) and uv.dtype == np.float32 and uv.shape == (*triangles.shape, 2):
        places = uv.reshape(-1, 2)  # of a million faces the way through doubles would be felt
    elif uv is not None:
        with np.errstate(over="ignore"):  # beyond 32 bits: infinite, as it would be stored
            places = as_corner_uv(uv, "uv", len(triangles)).astype(np.float32)
    first, nearly_joined = _native.islands(triangles, places)
    return first, nearly_joined


#: (vertices, faces, clean vertex of each vertex) -> map
SolvePart = Callable[[FloatArray, IntArray, IntArray], Parametrization]


def each_part(clean: SeparatedSurface, solve: SolvePart) -> Parametrization:
    """The parts' maps in the numbers of the clean surface, its vertices first. Places overlap; certificate and ``stats`` are
    the first part's that is not ok, or the first one's: judge the whole again."""
    pieces = []
    for own, used, faces in parts_of(clean):
        with named_on_input(clean.vertex_origin[used], clean.face_origin[own]):
            pieces.append((own, used, solve(clean.vertices[used], faces, used)))
    return combined(clean, pieces)


def parts_of(clean: SeparatedSurface) -> Iterator[tuple[IntArray, IntArray, IntArray]]:
    """(faces, vertices of the clean surface; faces in the numbers of these vertices) of each part."""
    label, _ = islands(clean.faces)
    for first in np.unique(label):
        own = np.flatnonzero(label == first).astype(np.int32)
        used, numbers = np.unique(clean.faces[own], return_inverse=True)
        yield own, used.astype(np.int32), numbers.reshape(-1, 3).astype(np.int32)


@contextmanager
def named_on_input(vertices: Array, faces: Array) -> Iterator[None]:
    """Errors that name what is a part's name what is the input's, which has these numbers for its vertices and faces."""
    try:
        yield
    except FlipfreeError as error:
        ids = np.array(error.elements, np.int64)
        numbers = {"vertex": vertices, "edge": vertices, "face": faces}.get(error.kind, ids[:0])
        if (ids >= len(numbers)).any():
            error.kind, ids = "none", ids[:0]
        error.elements = numbers[ids].tolist()
        raise


#: (faces, vertices of the whole, map of these)
Piece = tuple[Any, Any, Any]


def joined(vertices: FloatArray, pieces: list[Piece], names: str) -> dict[str, Any]:
    """The maps of parts as arrays of one, whose vertices come first, then those that the maps have added. names: of further ones
    at corners, which blanks part."""
    count = len(vertices)
    first_parent, first_weights = np.zeros(count, np.int32), np.zeros((count, 3))
    rows: dict[str, list[Array]] = {
        "vertices": [vertices],
        "vertex_parent": [first_parent],
        "vertex_barycentric": [first_weights],
    }
    for own, used, found in pieces:
        old, added = len(used), len(found.vertices) - len(used)
        number = np.concatenate([used, count + np.arange(added)]).astype(np.int32)
        count += added
        first_parent[used] = own[found.vertex_parent[:old]]
        first_weights[used] = found.vertex_barycentric[:old]
        columns: dict[str, Array] = {
            "vertices": found.vertices[old:],
            "faces": number[found.faces],
            "parent_face": own[found.parent_face],
            "vertex_parent": own[found.vertex_parent[old:]],
            "vertex_barycentric": found.vertex_barycentric[old:],
            "cut_edges": number[found.cut_edges].reshape(-1, 2),
            **{name: getattr(found, name) for name in names.split()},
        }
        for name, values in columns.items():
            rows.setdefault(name, []).append(values)
    return {name: np.concatenate(values) for name, values in rows.items()}


def combined(clean: SeparatedSurface, pieces: list[Piece]) -> Parametrization:
    """The maps of all parts, as of ``each_part``."""
    results: list[Parametrization] = [found for _, _, found in pieces]
    if len(results) == 1:
        return results[0]
    transitions = Transitions(
        np.concatenate([found.transitions.quarter_turns for found in results]),
        np.concatenate([found.transitions.translation.reshape(-1, 2) for found in results]),
    )
    return replace(
        next((found for found in results if not found.certificate.ok), results[0]),
        **joined(clean.vertices, pieces, "uv uv64 _uv32"),
        transitions=transitions,
        input_faces=clean.faces,
        log_weight=None,
    )
