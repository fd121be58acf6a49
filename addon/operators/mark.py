# SPDX-License-Identifier: GPL-3.0-or-later
"""Mark Line, Path or Loop: what Match Pins and fields are told besides pins and cones (meshes/marks.py)."""

import bpy

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


class MESH_OT_flipfree_mark(common.PlainOperator, bpy.types.Operator):
    bl_idname = "mesh.flipfree_mark"
    bl_label = "Mark Line, Path or Loop"
    bl_description = (
        "Mark selected edges as a line or path for Match Pins, or a ring of selected faces as a loop along which a field "
        "turns"
    )

    kind: options.choice("As: What the selection is marked as", KINDS)
    quarter_turns: options.whole(
        "Quarter Turns: To the left, along the ring from its first face towards that one's neighbour with the smaller number",
        (0, -400, 400),
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

    def work(self, context):
        ob = context.edit_object
        if self.kind == "loop":
            return (
                f"A loop of {common.plural(marks.mark_loop(ob, self.quarter_turns), 'face')} marked"
            )
        if self.kind == "none":
            return f"{common.plural(marks.clear(ob), 'mark')} cleared"
        count = marks.mark_chain(ob, self.kind)
        if not count:
            raise mesh_io.MeshProblem(f"{ob.name}: no edges are selected")
        return f"{common.plural(count, 'edge')} marked as a {self.kind}"
