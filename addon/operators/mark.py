# SPDX-License-Identifier: GPL-3.0-or-later
"""Mark Line, Path or Loop: what Match Pins and fields are told besides pins and cones (meshes/marks.py)."""

import bpy

from .. import errors
from ..meshes import marks, mesh_io
from . import common, options

KINDS = {
    "line": "Line: Match Pins: chains of the selected edges run straight from pin to pin, which may be on both ends only",
    "path": "Path: Match Pins: a chain of the selected edges, from a pin to the boundary, says on which sheet of an outline "
    "that overlaps itself the pin lies: the chain does not leave the target",
    "loop": "Loop: Field-Aligned Seamless Map with marked cones: along the selected ring of faces the field makes so many "
    "quarter turns",
    "none": "None: The selected edges and rings bear no mark any more",
}


class MESH_OT_flipfree_mark(bpy.types.Operator):
    bl_idname = "mesh.flipfree_mark"
    bl_label = "Mark Line, Path or Loop"
    bl_description = (
        "Mark selected edges as a line or path for Match Pins, or a ring of selected faces as a loop along which a field "
        "turns"
    )
    bl_options = {"REGISTER", "UNDO"}

    kind: options.choice("As", "What the selection is marked as", KINDS)
    quarter_turns: bpy.props.IntProperty(
        name="Quarter Turns",
        description="To the left, along the ring from its first face towards that one's neighbour with the smaller number",
        default=0,
        min=-400,
        max=400,
    )

    @classmethod
    def poll(cls, context):
        return common.allowed(
            cls, context.mode == "EDIT_MESH", "Works in Edit Mode, on selected edges or faces"
        )

    def draw(self, _context):
        self.layout.use_property_split = True
        self.layout.prop(self, "kind")
        if self.kind == "loop":
            self.layout.prop(self, "quarter_turns")

    def execute(self, context):
        ob = context.edit_object
        try:
            if self.kind == "loop":
                text = f"A loop of {common.plural(marks.mark_loop(ob, self.quarter_turns), 'face')} marked"
            elif self.kind == "none":
                text = f"{common.plural(marks.clear(ob), 'mark')} cleared"
            else:
                count = marks.mark_chain(ob, self.kind)
                if not count:
                    raise mesh_io.MeshProblem(f"{ob.name}: no edges are selected")
                text = f"{common.plural(count, 'edge')} marked as a {self.kind}"
        except mesh_io.MeshProblem as problem:
            errors.complain(self, str(problem))
            return {"CANCELLED"}
        self.report({"INFO"}, text)
        return {"FINISHED"}


CLASSES = (MESH_OT_flipfree_mark,)
