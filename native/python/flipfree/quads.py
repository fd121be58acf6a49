"""Quads: a surface as a mesh of quads along a cross field, half of it, which is mirrored, and the cells of a map as one; maps for
textures that repeat."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, NamedTuple, Unpack

import numpy as np

from . import _native, checks
from .calls.certification import with_tiles
from .calls.seamless import arrays_of
from .errors import bad_option, require
from .job import Job, Limits, StagedJob, Stages, job_of, solver_call, start_job
from .points import of_pieces
from .results import (
    Flags,
    FloatArray,
    IntArray,
    Ints,
    Mesh,
    Parametrization,
    ReadOnly,
    in_unit,
    parametrization_from,
)
from .separated import SeparatedSurface, edge_keys, edges_on, named_on_input, separate, turned_over
from .texts import counted

#: More are refused.
MOST_QUADS = 10_000_000


@dataclass(frozen=True, eq=False)
class QuadCertificate(ReadOnly):
    """What was measured about a quad mesh, from its arrays and the surface alone.

    Attributes:
        ok: all faces are quads of four vertices; no two edges have the same ends; manifold; components, genus and borders
            are the surface's; every vertex has as many quads as the map has quarter turns there, and there are as many as
            the map has cells; every vertex lies where its parent face and weights say.
        vertices, quads, components, genus, borders: counts. genus: summed over the components.
        irregular: (k, 2) inner vertices with other than 4 quads, those of the border with other than 2; and how many.
        edge_loops: chains of edges that go straight on through regular vertices.
        turned: (k,) quads that look against their parent face; not a failure: a coarse quad over a fold does.
        to_surface, to_quads: largest distances from the quads to the surface and back, over the diagonal of its bounding
            box, sampled at vertices, middles of sides and centres of faces. hausdorff: the larger one.
        failures: what failed, in words.
    """

    ok: bool
    vertices: int
    quads: int
    components: int
    genus: int
    borders: int
    irregular: IntArray
    edge_loops: int
    turned: IntArray
    to_surface: float
    to_quads: float
    failures: list[str]

    @property
    def hausdorff(self) -> float:
        return max(self.to_surface, self.to_quads)

    def __str__(self) -> str:
        return "\n".join(
            [
                f"certificate {'ok' if self.ok else 'FAILED'}: {counted(self.quads, 'quad')}, "
                f"{len(self.irregular)} irregular, {len(self.turned)} turned, genus {self.genus}, "
                f"{counted(self.borders, 'border')}, off by {100.0 * self.hausdorff:.2g} % at most",
                *(f"  {failure}" for failure in self.failures),
            ]
        )


@dataclass(frozen=True, eq=False, repr=False)
class QuadMesh(ReadOnly):
    """A mesh of quads on a surface. Its arrays are read-only: they are what was certified.

    Attributes:
        vertices: (n, 3). quads: (q, 4), counter-clockwise.
        parent_face: (n,), the input face that holds each vertex. barycentric: (n, 3), its weights there: whatever the
            input's corners carry is one gather.
        quad_parent: (q,), the input face at the middle of each quad.
        map: the integer parametrization, whose unit cells the quads are, before they were relaxed; of :func:`quads` only
            ``with_map``, with vertices on edges longer than three sides of a quad, and None where 32 bits do not hold it.
        certificate: measured. stats: "target", seconds per stage, "count_raised" 1 where whole numbers leave no mesh of so few,
            "proxy_faces" how many where a mesh of very many was decimated first, and the map's with the prefix "map.".
    """

    vertices: FloatArray
    quads: IntArray
    parent_face: IntArray
    barycentric: FloatArray
    quad_parent: IntArray
    map: Parametrization | None
    certificate: QuadCertificate
    stats: dict[str, Any]

    def __repr__(self) -> str:
        return f"<QuadMesh: {str(self.certificate).splitlines()[0]}>"


def _quad_mesh_from(data: dict[str, Any], mesh: Mesh) -> QuadMesh:
    found_map = None if data["map"] is None else parametrization_from(data["map"], mesh)
    data = data | dict(vertices=in_unit(data["vertices"], -mesh.exponent), map=found_map)
    return QuadMesh(**data | dict(certificate=_certificate_from(data["certificate"])))


def _certificate_from(data: dict[str, Any]) -> QuadCertificate:
    data["irregular"] = np.stack([data["irregular"], data.pop("valence")], axis=1)
    return QuadCertificate(**data)


@solver_call
def quads(
    vertices: Any,
    faces: Any,
    *,
    target: float | None = None,
    edge_length: float | None = None,
    field: Any = None,
    features: Any = None,
    sizing: Any = None,
    adaptive: float = 0.0,
    symmetry: str | None = None,
    with_map: bool = False,
    **limits: Unpack[Limits],
) -> Job[QuadMesh]:
    """A mesh of quads of the surface that follows a cross field, with the surface's topology.

    Args:
        vertices: (n, 3) float64. faces: (m, 3), any number of components, with or without borders, which become rows of quad
            edges. What is no manifold, oriented surface is separated first (``stats["separated"]``), unless a field is given.
        target: how many quads. edge_length: how long their sides are instead. One of them is needed. The count is within
            5 % of what is asked for where whole numbers allow it: small counts are sparse, and where so few quads would be no
            mesh there are more.
        field: a :class:`CrossField` of this mesh; None: the smoothest, without cones of one quarter turn, along the borders.
        features: (k, 2) edges that shall be rows of quad edges: sharp ones, borders of materials. What the field forbids is
            left, in part or whole, and counted: ``stats["features_missed"]`` of ``stats["features"]``; and of two at less
            than a tenth of a quad one, ``stats["features_close"]``, in pieces of at most 1.42 sides of a quad.
        sizing: (n,) positive: how dense quads are along a length there, relative to others; a field that is given should
            have been made for it. None: all alike. adaptive: 0 to 100, how much denser they are besides where the surface
            bends more; at 100 they are off it by about as much everywhere, as far as the map can be.
        symmetry: "x", "y" or "z": the half on the positive side of that axis becomes quads, with a row of edges on the plane
            through the origin, and is mirrored bit for bit. Where the mesh is not alike on both sides, the mirrored half lies off
            it, and has the faces nearest to it for parents. No field, and no ``map``.
        with_map: the result's ``map`` as well.
        max_seconds: of the clock; None or 0 is no limit. NotConverged (code "time limit reached") when they are over.
        threads: None is all cores; the result has the same bits for every number.
        progress: called with (stage, fraction) about 20 times per second; returning False cancels.

    Returns:
        The quads, certified.

    Raises:
        InvalidInput (also cones of one quarter turn), NotConverged, Cancelled.
    """
    if (target is None) == (edge_length is None):
        raise bad_option(
            "Give either target, how many quads, or edge_length, how long their sides are."
        )
    mesh, options = checks.checked(locals(), "with_map sizing features")
    options["adaptive"] = 0.01 * checks.real(least=0.0, most=100.0)(adaptive, "adaptive")
    if target is not None:
        options["target"] = checks.real(above=0.0, most=MOST_QUADS)(target, "target")
    clean = None if field is not None else separate(mesh.given, mesh.faces)
    if symmetry is not None:
        axis = "xyz".index(checks.as_choice(symmetry, "symmetry", ("x", "y", "z")))
        if clean is None:
            raise bad_option(
                "A field cannot be given together with symmetry: the half gets one of its own."
            )
        half = half_of(mesh.given, mesh.faces, axis)
        how = dict(edge_length=edge_length, adaptive=adaptive, **_carried(options, half))
        if target is not None:
            how["target"] = 0.5 * options["target"]
        return StagedJob(_mirrored(mesh, half, axis, how, limits))
    if clean is None:
        options["field"] = arrays_of(field, mesh.faces)
    elif clean.mends:
        mesh = checks.as_mesh(clean.vertices, clean.faces)
        options |= _carried(options, clean)
    if target is None:
        length = checks.as_positive(edge_length, "edge_length")
        options["edge_length"] = float(np.ldexp(length, -mesh.exponent))
    job = start_job(_native.quads, mesh, options, limits, _quad_mesh_from)
    return StagedJob(_on_input(job, clean)) if clean is not None and clean.mends else job


def _carried(options: dict[str, Any], surface: Half | SeparatedSurface) -> dict[str, Any]:
    """Those of the options that belong to edges and vertices, on what was made of their mesh."""
    known = {"features": surface.edges, "sizing": surface.of_vertices}
    return {name: carry(options[name]) for name, carry in known.items() if name in options}


def _on_input(job: Job[QuadMesh], clean: SeparatedSurface) -> Stages[QuadMesh]:
    """Of a separated surface, as those of the mesh that it was."""
    with named_on_input(clean.vertex_origin, clean.face_origin):
        found: QuadMesh = yield job, 1.0
    parent, weights = clean.on_faces(found.parent_face, found.barycentric)
    found.stats["separated"] = sum(mend.count for mend in clean.mends)
    return replace(
        found,
        parent_face=parent,
        quad_parent=clean.face_origin[found.quad_parent],
        barycentric=weights,
        map=None if found.map is None else clean.on_input(found.map),
    )


def _mirrored(
    mesh: Mesh, half: Half, axis: int, how: dict[str, Any], limits: Limits
) -> Stages[QuadMesh]:
    """Quads of one half, and what the two halves are together."""
    clean = separate(half.vertices, half.faces)
    if clean.mends:
        how |= _carried(how, clean)
    with (
        named_on_input(half.origin[:, 0], half.parent),
        named_on_input(clean.vertex_origin, clean.face_origin),
    ):
        found: QuadMesh = yield job_of(quads)(clean.vertices, clean.faces, **how, **limits), 0.9
    places, corners, paired = doubled(found.vertices, found.quads, axis)
    surface = checks.as_mesh(*doubled(clean.vertices, clean.faces, axis)[:2])
    first = len(clean.faces)
    parents = np.concatenate([found.parent_face, first + found.parent_face[paired]])
    of_quads = np.concatenate([found.quad_parent, first + found.quad_parent])
    # Corner 0 of a mirrored polygon is that of its twin, the others follow backwards.
    weights = np.concatenate([found.barycentric, found.barycentric[paired][:, [0, 2, 1]]])
    judged = dict(
        vertices=in_unit(places, surface.exponent),
        quads=np.ascontiguousarray(corners.ravel()),
        parent_face=parents.astype(np.int32),
        barycentric=weights,
        quad_parent=of_quads.astype(np.int32),
    )
    judging = start_job(_native.certify_quads, surface, judged, limits, lambda data, _: data)
    certificate = _certificate_from((yield judging, 1.0))
    require(certificate, "The two halves are no mesh together", "Ask for more quads.")

    def on_input(face: Any, weights: Any, points: Any) -> tuple[Any, Any]:
        other = face >= first
        own = clean.on_faces(face % first, turned_over(weights, other))
        parent, weights = half.on_faces(*own)
        there = in_unit(points[other], mesh.exponent)
        parent[other], weights[other] = _native.nearest(mesh.scaled, mesh.faces, there)
        return parent.astype(np.int32), weights

    parents, weights = on_input(parents, weights, places)
    middle = places[corners].mean(axis=1)
    of_quads, _ = on_input(of_quads, np.full((len(middle), 3), 1.0 / 3.0), middle)
    return replace(
        found,
        vertices=places,
        quads=corners,
        parent_face=parents,
        barycentric=weights,
        quad_parent=of_quads,
        certificate=certificate,
    )


#: Vertices this near to the plane, as a share of the extent, are on it.
_ON = 1e-6


class Half(NamedTuple):
    """What lies on the positive side of an axis.

    Attributes:
        vertices, faces: (h, 3), (k, 3). origin: (h, 2) the input's vertices between which each lies; share: (h,) of the way.
        parent, weights: (k,), (k, 3, 3) the input's face that holds each face, and the weights there of its corners.
    """

    vertices: FloatArray
    faces: IntArray
    origin: Ints
    share: FloatArray
    parent: Ints
    weights: FloatArray

    def of_vertices(self, values: FloatArray) -> FloatArray:
        a, b = (values[self.origin[:, k]] for k in (0, 1))
        return a + self.share * (b - a)

    def edges(self, pairs: IntArray) -> IntArray:
        """What is left of edges of the input."""
        return edges_on(self.faces, self.origin, pairs)

    def on_faces(self, faces: Any, weights: FloatArray) -> tuple[Ints, FloatArray]:
        """Points in faces of the half as such in faces of the input."""
        return self.parent[faces], np.einsum("vk,vkj->vj", weights, self.weights[faces])


def half_of(vertices: FloatArray, faces: IntArray, axis: int) -> Half:
    """Faces across the plane are divided there."""
    place, count = vertices[:, axis], len(vertices)
    near = _ON * float(np.ptp(vertices, axis=0).max(initial=0.0))
    side = np.where(np.abs(place) <= near, 0.0, np.sign(place))
    sides = side[faces]
    whole = np.flatnonzero((sides >= 0).all(axis=1) & (sides > 0).any(axis=1))
    across = np.flatnonzero((sides > 0).any(axis=1) & (sides < 0).any(axis=1))
    if not len(whole) + len(across):
        raise bad_option(
            "No face lies on the positive side of the plane of symmetry. Choose another axis."
        )
    before, after = faces[across], np.roll(faces[across], -1, axis=1)
    divided = side[before] * side[after] < 0
    ends = np.sort(np.stack([before, after], -1)[divided], axis=1)
    _, first, number = np.unique(edge_keys(ends), return_index=True, return_inverse=True)
    ends = np.concatenate([np.arange(count).repeat(2).reshape(-1, 2), ends[np.sort(first)]])
    low, high = place[ends].T
    share = np.append(np.zeros(count), low[count:] / (low[count:] - high[count:]))
    # Corners in turn with what divides the sides behind them; -1 where there is none.
    corner = np.full((len(across), 6), -1)
    corner[:, ::2] = np.where(side[before] >= 0, before, -1)
    corner[:, 1::2][divided] = count + np.argsort(np.argsort(first))[number]
    along = share[corner[:, 1::2], None]
    along = np.where((before < after)[..., None], along, 1.0 - along)
    weights = np.tile(np.eye(3), (len(across), 2, 1)).reshape(-1, 2, 3, 3).swapaxes(1, 2)
    weights[:, :, 1] += along * (np.roll(np.eye(3), 1, axis=1) - np.eye(3))
    # What is left has three or four corners.
    fan = np.argsort(corner < 0, axis=1, kind="stable")[:, [[0, 1, 2], [0, 2, 3]]]
    row, k = np.nonzero(corner[np.arange(len(across))[:, None, None], fan].min(axis=2) >= 0)
    at = row[:, None], fan[row, k]
    own = np.concatenate([np.tile(np.eye(3), (len(whole), 1, 1)), weights.reshape(-1, 6, 3)[at]])
    used, compact = np.unique(np.concatenate([faces[whole], corner[at]]), return_inverse=True)
    origin, along = ends[used], share[used]
    points = vertices[origin[:, 0]]
    points += along[:, None] * (vertices[origin[:, 1]] - points)
    points[(along > 0) | (side[origin[:, 0]] == 0), axis] = 0.0
    numbers = compact.reshape(-1, 3).astype(np.int32)
    return Half(points, numbers, origin, along, np.append(whole, across[row]), own)


def on_plane(vertices: FloatArray, polygons: Any, axis: int) -> Flags:
    """(n,) vertices of sides with one polygon that lie on the plane."""
    ends = np.stack([polygons, np.roll(polygons, -1, axis=1)], -1).reshape(-1, 2)
    sides, uses = np.unique(np.sort(ends, axis=1), axis=0, return_counts=True)
    near = _ON * float(np.ptp(vertices, axis=0).max(initial=0.0))
    rim = sides[(uses == 1) & (np.abs(vertices[sides, axis]) <= near).all(axis=1)]
    found = np.zeros(len(vertices), bool)
    found[rim] = True
    return found


def doubled(vertices: FloatArray, polygons: Any, axis: int) -> tuple[FloatArray, Any, Any]:
    """(vertices, polygons, (n,) whether each vertex has a twin) of both halves, joined where they meet; twins come second, in
    order, as do the polygons, which turn the other way."""
    on = on_plane(vertices, polygons, axis)
    points = vertices.copy()
    points[on, axis] = 0.0
    twin = np.where(on, np.arange(len(on)), len(on) + np.cumsum(~on) - 1)
    other = points[~on].copy()
    other[:, axis] = -other[:, axis]
    back = np.roll(twin[polygons][:, ::-1], 1, axis=1)
    both = np.concatenate([polygons, back]).astype(polygons.dtype)
    return np.concatenate([points, other]), both, ~on


@solver_call
def quads_from_map(parametrization: Parametrization, **limits: Unpack[Limits]) -> Job[QuadMesh]:
    """The unit cells of a seamless map, in which cones and corners are whole numbers apart, as a mesh of quads.

    Args:
        parametrization: a map whose seams match exactly as stored, with an aligned boundary if there is one.
        max_seconds, threads, progress: as in :func:`quads`.

    Returns:
        The quads, certified; ``parent_face``, ``barycentric`` and ``quad_parent`` are of the map's own faces.

    Raises:
        InvalidInput (no such map; names an edge; or its cells are no mesh: a torus of one cell), NotConverged,
        Cancelled.
    """
    if not isinstance(parametrization, Parametrization):
        raise bad_option(
            f"parametrization must be a Parametrization, not {checks.shown(parametrization)}. Make one by field_aligned()."
        )
    mesh = checks.as_mesh(parametrization.vertices, parametrization.faces)
    options = dict(uv32=parametrization.uv32().reshape(-1, 2))

    def convert(data: dict[str, Any], given: Mesh) -> QuadMesh:
        return replace(_quad_mesh_from(data, given), map=parametrization)

    return start_job(_native.quads_from_map, mesh, options, limits, convert)


@solver_call
def fit_tiles(
    map_or_arrays: Any,
    *,
    tile: float,
    features: Any = None,
    prefer_translations: bool = False,
    **limits: Unpack[Limits],
) -> Job[Parametrization]:
    """A seamless map at a scale at which a texture that repeats runs on through its seams: UV length 1 is the side of a tile,
    and transitions, cones, corners, borders and features along the axes are whole numbers, as stored (G9).

    Seams without a turn match for every texture that repeats; others for one that looks the same after a quarter turn, or a
    half: see ``transitions``. Borders that run along no axis stay free, where the seams are rounded one by one.

    Args:
        map_or_arrays: a :class:`Parametrization`, or (vertices, faces, uv), whose seams match exactly as stored.
        tile: how long the side of a tile shall be on the surface, in the unit of the vertices. Where whole numbers leave no
            map without a flip, tiles are smaller, by a few steps of sqrt(2): ``stats["tile"]`` is what came out.
        features: (k, 2) edges of the map's input that shall lie on lines between tiles. Those that run along no axis are
            left: ``certificate.features_missed``.
        prefer_translations: seams are moved so that those with a turn are as short as moving them one by one makes them: more
            of the surface then shows a texture without symmetry in one piece. Charts may lie on others afterwards.
        max_seconds: of the clock; None or 0 is no limit. NotConverged (code "time limit reached") when they are over.
        threads: None is all cores; the result has the same bits for every number.
        progress: called with (stage, fraction) about 20 times per second; returning False cancels.

    Returns:
        The map, certified, on the same faces; where whole numbers bend their edges so far that they flip, on a few pieces of
        them. stats: "tile", "tiles" (how many cover the surface), "seams" (edges),
        "seams_quarter", "seams_half" (those that turn by so much), "seams_matched" (share of the seams' length without a turn).

    Raises:
        InvalidInput (not seamless as stored; names an edge), NotConverged, Cancelled.
    """
    given = map_or_arrays if isinstance(map_or_arrays, Parametrization) else None
    vertices, faces, uv = checks.as_map(map_or_arrays, "fit_tiles")
    mesh, options = checks.checked(locals(), "uv prefer_translations")
    checks.refuse_beyond_storage(options["uv"], "uv")
    edges = checks.as_optional_indices(features, "features", 2)
    if given is not None:
        edges = _parts_of(given, edges)
    side = float(np.ldexp(checks.as_positive(tile, "tile"), -mesh.exponent))
    options |= dict(uv32=options.pop("uv").astype(np.float32), tile=side, features=edges)

    def convert(data: dict[str, Any], scaled: Mesh) -> Parametrization:
        found = parametrization_from(data, scaled)
        pieces = _parts_of(found, edges)
        certificate = with_tiles(found.certificate, found.faces, found.uv32(), pieces)
        require(certificate, "Fitting tiles did not pass its certificate, so nothing is returned")
        found.stats["tile"] = float(np.ldexp(found.stats["tile"], scaled.exponent))
        made = replace(found, certificate=certificate)
        return made if given is None else of_pieces(given, made)

    return start_job(_native.fit_tiles, mesh, options, limits, convert)


def _parts_of(given: Parametrization, edges: IntArray) -> IntArray:
    """(k, 2) edges of the map's faces that lie on these edges of its input."""
    weights = given.vertex_barycentric > 1e-12
    corners = given.input_faces[given.vertex_parent]
    low = np.where(weights, corners, np.iinfo(np.int32).max).min(axis=1)
    ends = np.stack([low, np.where(weights, corners, -1).max(axis=1)], axis=1)
    ends[weights.sum(axis=1) > 2] = -1
    return edges_on(given.faces, ends, edges)
