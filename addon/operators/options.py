# SPDX-License-Identifier: GPL-3.0-or-later
"""Options that several operators offer, each declared once, and what all map operators do alike.

    class UV_OT_x(options.NoOverlaps, options.MapOperator, bpy.types.Operator):
        mine: options.whole(...)

Blender collects annotations of plain base classes as well when it registers an operator, so a property is a line of one of
these classes. `tests/blender/test_registration.py` looks at every operator's properties.
"""

import inspect
import itertools

from flipfree.distortion import STRETCH_BOUND

from .. import aspect, modal, texture
from ..meshes import mesh_io
from ..properties import choice, flag, real, whole
from ..properties import words as words
from . import common, layout


class NoOverlaps:
    bijective: flag("No Overlaps: No island may overlap itself", on=True)


class KeepPins:
    use_pins: flag("Keep Pins: Pinned UVs keep their place exactly", on=True)


class UseModifiers:
    use_modifiers: flag(
        "Use Modifiers: Work on the surface as modifiers and shape keys deform it in the viewport. Only with such that leave "
        "the faces as they are: subdivision, mirror and the like are refused"
    )


class Stretch:
    stretch: real(
        "Stretch: Of automatic seams: lengths may change by about this factor. Lower is more seams: 1.1 is hardly any stretch, "
        "1.25 suits most textures, 2 is few cuts",
        (STRETCH_BOUND, 1.01, 100.0),
        soft_max=3.0,
        precision=2,
    )


class TextureSize:
    texture_size: whole(
        "Texture Size: Pixels of the texture's longer side. At first that of the scene, in the sidebar",
        (texture.SIZE, 16, 65536),
    )


class Margin(TextureSize):
    margin_pixels: real(
        "Margin: Least gap between packed islands, in pixels of the texture; half of it to the tile's border. At first that of "
        "the scene, in the sidebar",
        (texture.MARGIN, 0.0),
        soft_max=64.0,
        precision=1,
    )


class CorrectAspect:
    correct_aspect: flag(
        "Correct Aspect: Islands keep their shape on the active image, which may be wider than high: that of the UV editor the "
        "operator is called from, or else of the active material. Without an image textures are squares",
        on=True,
    )


class MeasureAspect:
    correct_aspect: flag(
        "Correct Aspect: Measured on the active image, which may be wider than high: that of the UV editor the operator is "
        "called from, or else of the active material. Off: in the unit square",
        on=True,
    )


class Placement(Margin):
    keep_placement: flag(
        "Keep Placement: Islands go back to where they were, all at one scale, if then none overlaps another and none leaves "
        "the unit square. Otherwise, and by default, they are packed together. Islands with pins always stay"
    )


class Packing(Margin):
    pack: flag(
        "Pack Islands: Pack the islands of all objects into the unit square, at one scale. Otherwise they keep their place, "
        "size and direction. Islands with pins always stay"
    )


def scale_bound(default: float):
    return real(
        "Scale Bound: Of suggested cones: the largest scale is at most so many times the smallest one. Lower is more cones",
        (default, 1.01),
        soft_max=100.0,
    )


def mark_cuts(attribute: str = ""):
    """attribute: what else is written with the marks."""
    text = "Mark Cuts as Seams: Mark the edges along which the map is cut"
    return flag(text + attribute, on=True)


ENGINES = {
    "auto": "Automatic: The first one that finds a map",
    "penner": "Edge Lengths: Changes the lengths of edges until all angles fit",
    "padding": "Padding: Pads the map of a cut surface until its seams fit: another road to the same cones, slower and with "
    "more added vertices",
}


def engine():
    return choice("Method: How the map is found", ENGINES)


def meet_pins():
    return flag(
        "Meet Pins: Pinned UVs, and those of the group `Pins`, keep their place exactly, as far as they are inside the map that "
        "is found without them: its cuts and boundaries stay. Sharp edges are followed then, but are no lines of the map"
    )


def fit_unit_square():
    return flag(
        "Fit Unit Square: Scale the map by a power of two, which keeps the seams exact, so that it fits the unit square. Off: "
        "one UV unit is one unit of the object, so that several objects have one scale",
        on=True,
    )


# Seconds of the clock per island, where an operator does not ask.
MAX_SECONDS = 300.0


class TimeLimit:
    max_seconds: real(
        "Time Limit: Most seconds per island. A map that was found by then is kept, however much it could still be improved; "
        "if there is none, nothing is changed. 0 is no limit",
        (MAX_SECONDS, 0.0),
        soft_max=3600.0,
        precision=1,
    )


class MapOperator(modal.SolverOperator):
    """Mixin for operators with one task per object. Subclasses give `make_task`.

    option_names: their properties in the order of the redo panel, passed on to the task; where a class does not say, its own and
    then those of the classes that it has before this one."""

    bl_options = {"REGISTER", "UNDO"}
    option_names: tuple = ()
    advanced: tuple = ()  # those of them that are drawn in a panel of their own, closed at first
    needs_uv = False
    joint_layout = False  # islands of all objects are packed together
    writes = True  # the mesh; the others have nothing to save

    def __init_subclass__(cls, **given):
        super().__init_subclass__(**given)
        if "option_names" not in vars(cls):
            parts = itertools.takewhile(lambda part: part is not MapOperator, cls.__mro__)
            names = (name for part in parts for name in inspect.get_annotations(part))
            cls.option_names = tuple(dict.fromkeys(names))

    def advice(self, tasks):
        return common.advice(tasks)

    def hint(self, tasks):
        return common.needles_hint(tasks)

    def between(self, tasks):
        return common.between_text(tasks)

    def make_task(self, snapshot, **options) -> modal.Task:
        """options: the operator's properties named in `option_names`."""
        raise NotImplementedError

    @classmethod
    def poll(cls, context):
        return common.poll(cls, context, needs_uv=cls.needs_uv)

    def needs(self) -> dict[str, bool]:
        """Options that change something under a condition only -> whether it holds; they are drawn only then."""
        return {}

    def draw_option(self, layout, context, name: str):
        layout.prop(self, name)

    def draw(self, context):
        self.layout.use_property_split = True
        self.layout.use_property_decorate = False
        needs = self.needs()
        shown = [name for name in self.option_names if needs.get(name, True)]
        for name in shown:
            if name not in self.advanced:
                self.draw_option(self.layout, context, name)
        if not self.advanced:
            return
        header, body = self.layout.panel(f"{type(self).__name__}_advanced", default_closed=True)
        header.label(text="Advanced")
        if body is not None:
            for name in self.advanced:
                if name in shown:
                    self.draw_option(body, context, name)

    def values(self, context) -> dict:
        """The options by the names that tasks have for them."""
        texture.take(self)
        values = {name: getattr(self, name) for name in self.option_names}
        if values.pop("correct_aspect", False):
            values["aspect"] = aspect.active(context)
        return texture.with_margin(values)

    def make_run(self, context):
        values = self.values(context)
        use_modifiers = values.pop("use_modifiers", False)
        snapshots, failures = yield from common.reading_meshes(context, use_modifiers=use_modifiers)
        if self.needs_uv:
            snapshots = [s for s in snapshots if s.layer_name]
            if not snapshots and not failures:
                raise mesh_io.MeshProblem("The mesh has no UV map yet. Unwrap it first")
        tasks = []
        for snapshot in snapshots:
            tasks.append(self.make_task(snapshot, **values))
            yield
        joint = layout.following(context, tasks) if self.joint_layout else layout.looking
        return modal.Run(tasks, failures, layout=joint)
