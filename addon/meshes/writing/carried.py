# SPDX-License-Identifier: GPL-3.0-or-later
"""What a mesh carries, on another mesh of the same surface whose vertices lie at barycentric weights in its triangles."""

from collections import defaultdict

import bpy
import numpy as np
from mathutils import kdtree

from ... import compat
from .. import labels, selection

# Hidden ones that users have made, unlike places and selections.
_HIDDEN = (".uv_seam", ".sculpt_face_set", ".sculpt_mask")
# A side of a face runs along an edge within this share of its own length.
_ALONG = 0.12


class Carried:
    """Reads the old mesh when it is made; then it may go."""

    def __init__(self, ob: bpy.types.Object, snapshot, own, found, symmetry: str | None = None):
        """own: (#Sv, 3) the snapshot's vertices in the object. found: flipfree.QuadMesh of the snapshot's surface, whose two
        halves mirror each other if `symmetry` says about which axis."""
        self._snapshot, self._own, self._found = snapshot, own, found
        self._vertices = snapshot.vertex_ids[snapshot.triangles[found.parent_face]]
        self.places = self.mixed(own[snapshot.triangles[found.parent_face]])
        if symmetry:
            self.places = _mirrored(self.places, found.vertices, "xyz".index(symmetry))
        old = ob.data
        self._materials = [slot.material for slot in ob.material_slots]
        self._attributes = list(self._read_attributes(old))
        self._uv_state = _state_of(old.uv_layers, ("active_index",))
        self._render_uv = next((i for i, uv in enumerate(old.uv_layers) if uv.active_render), -1)
        self._colours = _state_of(old.color_attributes, ("active_color_name", "default_color_name"))
        self._groups = list(self._weights(ob))
        self._keys = list(self._shape_keys(old))
        self._relative = old.shape_keys is None or old.shape_keys.use_relative

    def mixed(self, values):
        """(n, ...) of the new vertices from what the corners of their faces have, (n, 3, ...)."""
        return np.einsum("vk,vk...->v...", self._found.barycentric, values)

    def mesh(self, name: str) -> bpy.types.Mesh:
        """The new mesh, with all but what belongs to its object."""
        mesh = bpy.data.meshes.new(name)
        mesh.from_pydata(self.places.tolist(), [], self._found.quads.tolist(), shade_flat=False)
        for material in self._materials:
            mesh.materials.append(material)
        along = self._along(mesh)
        for name, kind, domain, values in self._attributes:
            if domain == "EDGE":
                values = np.where(along[:, None] >= 0, values[along], np.zeros_like(values[:1]))
            made = mesh.attributes.get(name) or mesh.attributes.new(name, kind, domain)
            made.data.foreach_set(compat.TYPES[kind][0], np.ascontiguousarray(values).ravel())
        for layers, state in (
            (mesh.uv_layers, self._uv_state),
            (mesh.color_attributes, self._colours),
        ):
            for key, value in state.items():
                setattr(layers, key, value)
        if self._render_uv >= 0:
            mesh.uv_layers[self._render_uv].active_render = True
        return mesh

    def give(self, ob: bpy.types.Object) -> None:
        """Vertex groups and shape keys, once the object has the new mesh."""
        for name, weights in self._groups:
            own = ob.vertex_groups.get(name) or ob.vertex_groups.new(name=name)
            for vertex in np.flatnonzero(weights).tolist():
                own.add([vertex], weights[vertex], "REPLACE")
        made = {}
        for name, places, state, relative in self._keys:
            key = made[name] = ob.shape_key_add(name=name, from_mix=False)
            key.points.foreach_set("co", places.astype(np.float32).ravel())
            for option, value in state.items():
                setattr(key, option, value)
            key.relative_key = made.get(relative, key)
        if made:
            ob.data.shape_keys.use_relative = self._relative

    def _read_attributes(self, old):
        """(name, type, domain, values): of edges those of the old mesh, else those of the new one."""
        snapshot, found = self._snapshot, self._found
        loops = snapshot.triangle_loops[found.parent_face]
        nearest = found.barycentric.argmax(axis=1)[:, None]
        for given in old.attributes:
            kind, domain = given.data_type, given.domain
            hidden = given.name.startswith(".") and given.name not in _HIDDEN
            if (
                kind not in compat.TYPES
                or hidden
                or given.name == "position"
                or domain not in _DOMAINS
            ):
                continue
            values = compat.rows(given.data, kind)
            if domain == "FACE":
                values = values[snapshot.triangle_face[found.quad_parent]]
            elif domain == "CORNER" and kind == "FLOAT2":
                values = self._of_islands(values)
            elif domain != "EDGE":
                corners = self._vertices if domain == "POINT" else loops
                if kind in compat.SUMS:
                    values = self.mixed(values[corners]).astype(np.float32)
                else:
                    values = values[np.take_along_axis(corners, nearest, axis=1)[:, 0]]
                values = values if domain == "POINT" else values[found.quads.ravel()]
            yield given.name, kind, domain, values

    def _of_islands(self, values):
        """(4 q, 2) UVs of the new corners, each quad on the island at its middle: where a corner lies on another island, or
        beyond a seam, as the triangle at the middle goes on, or one that it touches."""
        snapshot, found = self._snapshot, self._found
        uv = values[snapshot.triangle_loops].astype(np.float64)
        island = labels.island_labels(snapshot.triangles, uv.astype(np.float32))
        own = self.mixed(uv[found.parent_face])[found.quads]
        middle = snapshot.triangles[found.quad_parent]
        beyond = _continued(self._own[middle], uv[found.quad_parent], self.places[found.quads])
        size = np.linalg.norm(beyond - beyond.mean(axis=1, keepdims=True), axis=2).max(axis=1)
        chart = island[found.quad_parent]
        off = np.linalg.norm(own - beyond, axis=2)
        wrong = (island[found.parent_face][found.quads] != chart[:, None]) | (off > size[:, None])
        around = defaultdict(list)
        if wrong.any():
            touched = np.unique(snapshot.triangles[found.parent_face[found.quads[wrong]]])
            for triangle in np.flatnonzero(
                np.isin(snapshot.triangles, touched).any(axis=1)
            ).tolist():
                for vertex in snapshot.triangles[triangle].tolist():
                    around[vertex].append(triangle)
        for q, k in np.argwhere(wrong).tolist():
            vertex = found.quads[q, k]
            corners = snapshot.triangles[found.parent_face[vertex]]
            weights = {
                c: w
                for c, w in zip(corners.tolist(), found.barycentric[vertex].tolist(), strict=True)
                if w > 1e-9
            }
            places = [
                sum(w * uv[t, snapshot.triangles[t].tolist().index(c)] for c, w in weights.items())
                for t in set.intersection(*(set(around[c]) for c in weights))
                if island[t] == chart[q]
            ]
            best = min(places, key=lambda p: np.linalg.norm(p - beyond[q, k]), default=beyond[q, k])
            near = np.linalg.norm(best - beyond[q, k]) <= size[q]
            own[q, k] = best if near else beyond[q, k]
        return own.reshape(-1, 2).astype(np.float32)

    def _along(self, mesh):
        """(#edges,) of the new mesh: the old edge that each runs along, -1 for none; of old edges those that carry something."""
        marked = np.zeros(len(self._snapshot.edges), bool)
        for _, _, domain, values in self._attributes:
            if domain == "EDGE":
                marked |= (values != 0).any(axis=1)
        ends = compat.edge_vertices(mesh)
        found = np.full(len(ends), -1)
        position = np.full((int(self._snapshot.edges.max(initial=0)) + 1, 3), np.nan)
        position[self._snapshot.vertex_ids] = self._own
        old = position[self._snapshot.edges]
        marked &= np.isfinite(old).all(axis=(1, 2))
        if not marked.any():
            return found
        start, end = self.places[ends[:, 0]], self.places[ends[:, 1]]
        length = np.linalg.norm(end - start, axis=1)
        edges = np.flatnonzero(marked)
        long = np.linalg.norm(old[edges, 1] - old[edges, 0], axis=1)
        step = max(0.25 * float(np.median(length)), float(long.sum()) / 200_000)
        tree_of = [
            (edge, max(int(np.ceil(size / step)), 1))
            for edge, size in zip(edges.tolist(), long.tolist(), strict=True)
        ]
        tree = kdtree.KDTree(sum(count + 1 for _, count in tree_of))
        for edge, count in tree_of:
            for i in range(count + 1):
                tree.insert(old[edge, 0] + i / count * (old[edge, 1] - old[edge, 0]), edge)
        tree.balance()
        fits = np.ones(len(ends), bool)
        for share in (1 / 6, 5 / 6, 1 / 2):
            points = start + share * (end - start)
            nearest = np.array([tree.find(p)[1] for p in points])
            a, way = old[nearest, 0], old[nearest, 1] - old[nearest, 0]
            t = np.einsum("ij,ij->i", points - a, way) / np.maximum(
                np.einsum("ij,ij->i", way, way), 1e-300
            )
            off = np.linalg.norm(points - a - np.clip(t, 0.0, 1.0)[:, None] * way, axis=1)
            fits &= off <= _ALONG * length
        found[fits] = nearest[fits]
        return found

    def _weights(self, ob):
        """(name, (n,) weights of the new vertices) of the vertex groups."""
        rows = selection.weights(ob.data, *ob.vertex_groups)
        for group, row in zip(ob.vertex_groups, rows, strict=True):
            yield group.name, self.mixed(row[self._vertices])

    def _shape_keys(self, old):
        """(name, (n, 3) places, options, name of the key that it is relative to) of each."""
        for key in old.shape_keys.key_blocks if old.shape_keys else ():
            places = compat.values(key.data, "co", np.float32, 3)
            names = ("slider_min", "slider_max", "value", "mute", "interpolation", "vertex_group")
            state = {name: getattr(key, name) for name in names}
            yield (
                key.name,
                self.mixed(places[self._vertices].astype(float)),
                state,
                key.relative_key.name,
            )


_DOMAINS = ("POINT", "EDGE", "FACE", "CORNER")


def _mirrored(places, found, axis: int):
    """Places in the object, as much alike on both sides as those that were found."""
    back = found.copy()
    back[:, axis] *= -1.0
    rows = {place: v for v, place in enumerate(map(tuple, (found + 0.0).tolist()))}
    twin = np.array([rows[place] for place in map(tuple, (back + 0.0).tolist())])
    made, right = places.copy(), found[:, axis] > 0
    made[twin[right]] = places[right]
    made[twin[right], axis] *= -1.0
    made[twin == np.arange(len(twin)), axis] = 0.0
    return made


def _state_of(layers, names) -> dict:
    return {name: getattr(layers, name) for name in names} if len(layers) else {}


def _continued(corners, uv, places):
    """(q, 4, 2) at places (q, 4, 3) near triangles (q, 3, 3): their affine maps, in their planes."""
    a, b = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    normal = np.cross(a, b)
    area = np.maximum(np.einsum("qi,qi->q", normal, normal), 1e-300)[:, None]
    off = places - corners[:, :1]
    second = np.einsum("qki,qi->qk", np.cross(a[:, None], off), normal) / area
    first = np.einsum("qki,qi->qk", np.cross(off, b[:, None]), normal) / area
    ways = uv[:, 1:] - uv[:, :1]
    return uv[:, :1] + first[..., None] * ways[:, None, 0] + second[..., None] * ways[:, None, 1]
