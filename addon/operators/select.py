# SPDX-License-Identifier: GPL-3.0-or-later
"""Select Where It Failed, Mesh Defects, Stretched Islands, Faces by Map: shown in the viewport or the UV editor."""

import bpy
import numpy as np

from flipfree.distortion import STRETCH_BOUND

from .. import compat, errors, mends, modal, solver
from ..aspect import sides
from ..meshes import labels, mesh_io, selection
from ..views import faults, measures
from . import common, options


def show(context, places: list) -> None:
    """Selects these elements and nothing else: places is [(object, "vertex" | "edge" | "face", ids)]. Enters Edit Mode.

    In a UV editor that has a selection of its own, faces are selected there, and the mesh's selection only grows by them.
    """
    if context.mode == "OBJECT":
        for ob in context.selected_objects:
            ob.select_set(False)
        for ob, _, _ in places:
            ob.hide_set(False)
            ob.select_set(True)
        context.view_layer.objects.active = places[0][0]
        bpy.ops.object.mode_set(mode="EDIT")
    in_uv_editor = context.area is not None and context.area.type == "IMAGE_EDITOR"
    if in_uv_editor and not context.tool_settings.use_uv_select_sync:
        shown = {ob: ids for ob, kind, ids in places if kind == "face"}
        if shown:
            for ob in context.objects_in_mode_unique_data:
                compat.select_uv_faces(ob.data, shown.get(ob, np.zeros(0, np.int64)))
            return
    bpy.ops.mesh.select_all(action="DESELECT")
    kinds = {kind for _, kind, _ in places}
    for ob, kind, ids in places:
        selection.select_only(ob, kind, ids, modes=kinds)


class _SelectPlaces(common.PlainOperator):
    """Selects what a run left behind. Subclasses have `there_are()` and `places()`: [(object, kind, ids)]; `nothing`: why there
    is nothing to select; `changed`, `again`: which mesh there is no longer, and what to do."""

    @classmethod
    def poll(cls, context):
        if context.mode not in {"OBJECT", "EDIT_MESH"}:
            cls.poll_message_set("Works in Object Mode and in Edit Mode of meshes")
            return False
        return common.allowed(cls, cls.there_are(), cls.nothing)

    def work(self, context):
        found = self.places()
        if context.mode == "EDIT_MESH":
            editing = set(context.objects_in_mode)
            found = [place for place in found if place[0] in editing]
        if not found:
            raise mesh_io.MeshProblem(
                f"The mesh is no longer the one that {self.changed}, or not the one in Edit Mode. {self.again}"
            )
        show(context, found)
        counts = [common.plural(len(ids), kind, _MANY[kind]) for _, kind, ids in found]
        return f"{', '.join(counts)} selected"


class UV_OT_flipfree_select_failed(_SelectPlaces, bpy.types.Operator):
    bl_idname = "uv.flipfree_select_failed"
    bl_label = "Select Where It Failed"
    bl_description = "Select what the last error message speaks of"
    nothing = "The last run did not fail, or nowhere in particular"
    changed, again = "the run failed on", "Run it again"
    there_are = staticmethod(errors.has_places)

    @staticmethod
    def places():
        return [(ob, failure.kind, failure.elements) for ob, failure in errors.places()]


class UV_OT_flipfree_select_mends(_SelectPlaces, bpy.types.Operator):
    bl_idname = "uv.flipfree_select_mends"
    bl_label = "Select Mesh Defects"
    bl_description = (
        "Select what the last report calls separated: edges with more than two faces, vertices where parts touch, faces without "
        "area and the like. They are mapped; the mesh stays as it is"
    )
    nothing = "The last run separated nothing"
    changed, again = "was separated", "Run the operator again"
    there_are = staticmethod(mends.there_are)
    places = staticmethod(mends.places)


_MANY = {"vertex": "vertices", "edge": "edges", "face": "faces"}


class _FoundTask(modal.Task):
    """Faces of a whole object by its active map. Leaves the object alone: the operator selects in all of them together."""

    aspect = 1.0
    faces = np.zeros(0, np.int64)

    def write(self, ob):
        pass


class DistortedTask(_FoundTask):
    """Which islands are distorted beyond the bound."""

    islands = 0

    def start(self):
        common.refuse_nonfinite_uvs(self.snapshot)
        return solver.certify(self.snapshot, self.snapshot.corner_uv, aspect=self.aspect)

    def collect(self, result):
        label = labels.island_labels(self.snapshot.triangles, self.snapshot.corner_uv)
        chosen = np.unique(label[result.poor_islands])
        self.islands = len(chosen)
        self.faces = np.unique(self.snapshot.triangle_face[np.isin(label, chosen)])


def _show_faces(tasks) -> int:
    """Selects what tasks have found; how many faces that are. Leaves everything alone if none."""
    found = [(bpy.data.objects.get(task.snapshot.object_name), task.faces) for task in tasks]
    places = [(ob, "face", chosen) for ob, chosen in found if ob is not None and len(chosen)]
    if places:
        show(bpy.context, places)
    return sum(len(task.faces) for task in tasks)


class UV_OT_flipfree_select_poor(options.MeasureAspect, options.MapOperator, bpy.types.Operator):
    bl_idname = "uv.flipfree_select_poor"
    bl_label = "Select Stretched Islands"
    bl_description = (
        f"Select the islands of the UV map that are stretched beyond {STRETCH_BOUND}: more seams there give a better map. "
        "At most the hundred worst"
    )
    needs_uv = True

    def make_run(self, context):
        values = self.values(context)
        return modal.Run(*common.whole_objects(context, lambda s, _: DistortedTask(s, **values)))

    def summary(self, tasks):
        if not _show_faces(tasks):
            return f"No island is stretched beyond {STRETCH_BOUND}"
        count = common.plural(sum(task.islands for task in tasks), "island")
        return f"{count} stretched beyond {STRETCH_BOUND}, now selected. Mark more seams there, or use Cut Where Stretched"


WHAT = {
    "flipped": "Flipped: Faces that lie on their back in the map, unless their whole island does",
    "mirrored": "Mirrored: Islands that lie on their back as a whole",
    "degenerate": "Without Area: Faces that the map makes a line or a point of",
    "overlapping": "Overlapping: Faces where islands lie on themselves or on each other",
    "worst": "Most Distorted: Faces of the largest symmetric Dirichlet: stretched, shrunk or sheared",
    "sheared": "Most Sheared: Faces of which the map makes one direction much longer than the other",
    "small": "Smallest in the Map: Faces with the least pixels for their size",
}
_BY_MEASURE = ("worst", "sheared", "small")


class FacesTask(_FoundTask):
    """By what the map does to them."""

    what = "flipped"
    islands = False

    def __init__(self, snapshot, *, share=5.0, **options):
        super().__init__(snapshot, **options)
        self.share = share / 100.0

    def start(self):
        common.refuse_nonfinite_uvs(self.snapshot)
        if self.what == "overlapping":
            return faults.start(self.snapshot)
        if self.what in _BY_MEASURE:
            self._take(self._worst())
        else:
            sign, mirrored = faults.sides(self.snapshot)
            chosen = {
                "flipped": (sign < 0) & ~mirrored,
                "degenerate": sign == 0,
                "mirrored": mirrored,
            }
            self._take(np.unique(self.snapshot.triangle_face[chosen[self.what]]))
        return None

    def collect(self, result):
        self._take(faults.collect(self.snapshot, result).overlapping)

    def _worst(self) -> np.ndarray:
        """Faces, the worst first, that make up the wanted share of the surface."""
        snapshot = self.snapshot
        seen = snapshot.corner_uv * sides(self.aspect)
        found = measures.stretch(snapshot.vertices[snapshot.triangles], seen)
        values = {
            "worst": measures.dirichlet,
            "sheared": measures.angle,
            "small": lambda found: -found.det,
        }[self.what](found)
        values = measures.of_faces(values, found.area, snapshot.triangle_face)
        values = np.where(np.isnan(values), -np.inf, values)
        order = np.argsort(-values, kind="stable")
        before = np.cumsum(found.area[order]) - found.area[order]
        chosen = order[before < self.share * float(found.area.sum())]
        return np.unique(snapshot.triangle_face[chosen])

    def _take(self, faces: np.ndarray) -> None:
        if self.islands:
            snapshot = self.snapshot
            label = labels.island_labels(snapshot.triangles, snapshot.corner_uv)
            named = label[np.isin(snapshot.triangle_face, faces)]
            faces = np.unique(snapshot.triangle_face[np.isin(label, named)])
        self.faces = faces


class UV_OT_flipfree_select_faces(options.MeasureAspect, options.MapOperator, bpy.types.Operator):
    bl_idname = "uv.flipfree_select_faces"
    bl_label = "Select Faces by Map"
    bl_description = "Select faces that are flipped, without area, overlapping or most distorted in the UV map, or their islands"
    needs_uv = True

    what: options.choice("Faces: Which faces are selected", WHAT)
    share: options.real(
        "Share: How much of the surface is selected: the worst faces that make up so many per cent of its area",
        (5.0, 0.0, 100.0),
        subtype="PERCENTAGE",
    )
    islands: options.flag("Whole Islands: Select all faces of the islands that have such faces")

    def needs(self):
        return dict.fromkeys(("share", "correct_aspect"), self.what in _BY_MEASURE)

    def make_run(self, context):
        values = self.values(context)
        return modal.Run(*common.whole_objects(context, lambda s, _: FacesTask(s, **values)))

    def summary(self, tasks):
        name = WHAT[self.what].partition(":")[0]
        count = _show_faces(tasks)
        return (
            f"{name}: {common.plural(count, 'face')}, now selected" if count else f"{name}: no face"
        )
