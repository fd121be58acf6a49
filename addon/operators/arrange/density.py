# SPDX-License-Identifier: GPL-3.0-or-later
"""Get and Set Texel Density: pixels of the texture per unit of the scene."""

import bpy
import numpy as np

from ... import aspect, scene, texture
from ...meshes import labels, mesh_io
from ...views import measures
from .. import common, options
from . import moved

# What the last Get found; Set starts with it.
_last = {"density": 0.0, "texture_size": 1024}


def areas_in_scene(snapshot) -> np.ndarray:
    """(#St,) of the triangles as the object stands in the scene."""
    ob = bpy.data.objects[snapshot.object_name]
    corners = scene.placed(snapshot.vertices, ob)[snapshot.triangles]
    return measures.stretch(corners, snapshot.corner_uv).area


def pixels_of(size: int, ratio: float) -> float:
    """The root of how many pixels a texture of this shape has, `size` of them along its longer side."""
    return size * float(aspect.sides(ratio).prod()) ** 0.5


def of_areas(surface: np.ndarray, uv: np.ndarray, pixels: float) -> float:
    """Pixels per unit of the scene, over triangles of these areas there with these UVs (k, 3, 2); 0 without area."""
    total = float(surface.sum())
    plane = float(np.abs(moved.areas(uv)).sum())
    return pixels * (plane / total) ** 0.5 if total > 0 else 0.0


class UV_OT_flipfree_get_density(
    common.PlainOperator, options.TextureSize, options.MeasureAspect, bpy.types.Operator
):
    bl_idname = "uv.flipfree_get_density"
    bl_label = "Get Texel Density"
    bl_description = (
        "Report how many pixels of the texture the selected faces have per unit of the scene: on average, and of the island with "
        "the least and with the most. Set Texel Density starts with the average"
    )
    bl_options = {"REGISTER"}

    @classmethod
    def poll(cls, context):
        return common.poll(cls, context, needs_uv=True)

    def work(self, context):
        snapshots, failures = common.read_meshes(context)
        texture.take(self)
        ratio = aspect.active(context) if self.correct_aspect else 1.0
        pixels = pixels_of(self.texture_size, ratio)
        found = self._islands([s for s in snapshots if s.layer_name], pixels)
        if not found:
            text = str(failures[0]) if failures else "There is no face with an area and a UV map"
            raise mesh_io.MeshProblem(text)
        surface = sum(area for area, _ in found)
        # Areas add up, lengths do not: the mean of squares.
        mean = (sum(area * d**2 for area, d in found) / surface) ** 0.5
        each = [d for _, d in found]
        _last.update(density=mean, texture_size=self.texture_size)
        return (
            f"{mean:.4g} px per unit, {common.plural(len(each), 'island')} of {min(each):.4g} to {max(each):.4g}, "
            f"for a texture of {self.texture_size} pixels"
        )

    def _islands(self, snapshots, pixels: float) -> list[tuple[float, float]]:
        """(area in the scene, density) of each island with an area."""
        found = []
        for snapshot in snapshots:
            label = labels.island_labels(snapshot.triangles, snapshot.corner_uv)
            plane = np.abs(moved.areas(snapshot.corner_uv.astype(np.float64)))
            _, island = np.unique(label, return_inverse=True)
            surface = np.bincount(island, areas_in_scene(snapshot))
            with np.errstate(divide="ignore", invalid="ignore"):
                density = pixels * np.sqrt(np.bincount(island, plane) / surface)
            known = (surface > 0) & np.isfinite(density)
            found += zip(surface[known].tolist(), density[known].tolist(), strict=True)
        return found


class DensityTask(moved.MovedTask):
    density = 512.0

    def __init__(self, snapshot, *, texture_size=1024, together=False, **options):
        super().__init__(snapshot, **options)
        self.pixels = pixels_of(texture_size, self.aspect)
        self.surface = areas_in_scene(snapshot)
        self._of_all = None  # the density of all islands together
        if together:
            uv = snapshot.corner_uv.astype(np.float64)
            self._of_all = of_areas(self.surface, uv, self.pixels)

    def place(self, triangles, uv):
        now = self._of_all
        if now is None:
            now = of_areas(self.surface[triangles], uv, self.pixels)
        if not (now > 0 and np.isfinite(now)):
            return None
        middle = moved.centre(uv)
        return middle + (uv - middle) * (self.density / now)


class UV_OT_flipfree_set_density(
    options.KeepPins,
    options.TextureSize,
    options.MeasureAspect,
    options.MapOperator,
    bpy.types.Operator,
):
    bl_idname = "uv.flipfree_set_density"
    bl_label = "Set Texel Density"
    bl_description = (
        "Scale islands about their centres until they have so many pixels of the texture per unit of the scene. They may overlap "
        "or leave the tile then: Pack Islands without Same Density keeps the sizes"
    )
    needs_uv = True
    option_names = "density texture_size together use_pins correct_aspect".split()

    density: options.real(
        "Density: Pixels of the texture per unit of the scene",
        (512.0, 1e-6),
        soft_max=8192.0,
        precision=2,
    )
    together: options.flag(
        "Keep Proportions: All islands of an object are scaled alike, and only their average is met. Otherwise each of them "
        "meets it"
    )

    def invoke(self, context, event):
        if _last["density"] > 0.0 and not self.properties.is_property_set("density"):
            self.density, self.texture_size = _last["density"], _last["texture_size"]
        return super().invoke(context, event)

    make_task = staticmethod(DensityTask)

    def summary(self, tasks):
        scaled = common.plural(sum(t.moved for t in tasks), "island")
        return f"{scaled} at {self.density:.4g} px per unit: {moved.notes(tasks)}"
