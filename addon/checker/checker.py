# SPDX-License-Identifier: GPL-3.0-or-later
"""Show Checker, Remove Checker: a modifier gives the evaluated mesh another material, so that the object's own materials,
slots and faces are never touched; taking it away takes the modifier, and what nothing else uses of it.
"""

import bpy

from .. import aspect, compat
from ..operators import common, options
from . import patterns

NAME = "Flipfree Checker"
# Of 3D viewports in solid shading that were made to show textures: (pointer of the space, how they were coloured before).
_before: dict[int, str] = {}


def is_checked(ob: bpy.types.Object) -> bool:
    return NAME in ob.modifiers


def add(ob: bpy.types.Object, pattern: str) -> None:
    """On the active UV map, with squares on the texture that the object has; another pattern replaces the one that is there.
    No-op without a UV map."""
    layer = ob.data.uv_layers.active
    if layer is None:
        return
    remove(ob)
    modifier = ob.modifiers.new(NAME, "NODES")
    modifier.node_group = _group(_material(_image(pattern, aspect.shown(ob)), layer.name))
    modifier.show_in_editmode = modifier.show_on_cage = True


def remove(ob: bpy.types.Object) -> None:
    modifier = ob.modifiers.get(NAME)
    if modifier is not None:
        ob.modifiers.remove(modifier)


def forget_unused() -> None:
    """Takes what no checker uses any more out of the file: groups, materials, images, in this order."""
    for collection in (bpy.data.node_groups, bpy.data.materials, bpy.data.images):
        for block in [b for b in collection if b.name.startswith(NAME) and b.users == 0]:
            collection.remove(block)


def _image(pattern: str, ratio: float) -> bpy.types.Image:
    width, height = patterns.size(ratio)
    name = f"{NAME} {pattern}" + ("" if ratio == 1.0 else f" {width}x{height}")
    image = bpy.data.images.get(name)
    if image is not None:
        return image
    image = bpy.data.images.new(name, width, height)
    if pattern == "grid":
        image.generated_type = "COLOR_GRID"
    else:
        image.pixels.foreach_set(patterns.pixels(pattern, ratio).ravel())
        image.update()
        image.pack()
    return image


def _material(image: bpy.types.Image, layer: str) -> bpy.types.Material:
    """Shows the image in the colours that it has, on this UV map, in solid shading too."""
    name = f"{image.name} {layer}"
    material = bpy.data.materials.get(name)
    if material is not None:
        return material
    material = bpy.data.materials.new(name)
    compat.use_nodes(material)
    nodes, links = material.node_tree.nodes, material.node_tree.links
    nodes.clear()
    output = nodes.new("ShaderNodeOutputMaterial")
    surface = nodes.new("ShaderNodeBsdfDiffuse")
    texture = nodes.new("ShaderNodeTexImage")
    place = nodes.new("ShaderNodeUVMap")
    place.uv_map = layer
    texture.image = image
    links.new(place.outputs["UV"], texture.inputs["Vector"])
    links.new(texture.outputs["Color"], surface.inputs["Color"])
    links.new(surface.outputs["BSDF"], output.inputs["Surface"])
    nodes.active = texture
    return material


def _group(material: bpy.types.Material) -> bpy.types.NodeTree:
    name = material.name
    group = bpy.data.node_groups.get(name)
    if group is not None:
        return group
    group = bpy.data.node_groups.new(name, "GeometryNodeTree")
    group.interface.new_socket("Geometry", in_out="INPUT", socket_type="NodeSocketGeometry")
    group.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    nodes, links = group.nodes, group.links
    start, end = nodes.new("NodeGroupInput"), nodes.new("NodeGroupOutput")
    setter = nodes.new("GeometryNodeSetMaterial")
    setter.inputs["Material"].default_value = material
    links.new(start.outputs[0], setter.inputs["Geometry"])
    links.new(setter.outputs["Geometry"], end.inputs[0])
    return group


# -- viewports
# ------------------------------------------------------------------------------------------------------


def _spaces() -> list:
    return [
        area.spaces.active
        for window in bpy.context.window_manager.windows
        for area in window.screen.areas
        if area.type == "VIEW_3D"
    ]


def show_textures() -> None:
    """In viewports with solid shading."""
    for space in _spaces():
        if space.shading.type == "SOLID" and space.shading.color_type != "TEXTURE":
            _before[space.as_pointer()] = space.shading.color_type
            space.shading.color_type = "TEXTURE"


def shows_textures() -> bool:
    """Whether some viewport still does so because of a checker, be it that its objects were deleted."""
    return any(space.as_pointer() in _before for space in _spaces())


def show_as_before() -> None:
    for space in _spaces():
        colours = _before.pop(space.as_pointer(), None)
        if colours is not None and space.shading.color_type == "TEXTURE":
            space.shading.color_type = colours


# -- operators
# ------------------------------------------------------------------------------------------------------


def _objects(context) -> list:
    """Selected mesh objects, those in edit mode, and no mesh's only once: each object has its own modifiers."""
    chosen = {*context.selected_objects, *context.objects_in_mode}
    return sorted((ob for ob in chosen if ob.type == "MESH"), key=lambda ob: ob.name)


class UV_OT_flipfree_checker(bpy.types.Operator):
    bl_idname = "uv.flipfree_checker"
    bl_label = "Show Checker"
    bl_description = (
        "Show a test pattern on the active UV map of selected objects. Their own materials stay as they are: Remove Checker "
        "takes everything away again"
    )
    bl_options = {"REGISTER", "UNDO"}

    pattern: options.choice("Pattern: What is shown", patterns.PATTERNS)

    @classmethod
    def poll(cls, context):
        return common.poll(cls, context, needs_uv=True)

    def execute(self, context):
        objects = _objects(context)
        refused = [ob.name for ob in objects if not ob.is_editable]
        shown = [ob for ob in objects if ob.is_editable and ob.data.uv_layers.active is not None]
        for ob in shown:
            add(ob, self.pattern)
        forget_unused()
        if not bpy.app.background:
            show_textures()
        if refused:
            self.report(
                {"WARNING"},
                f"{refused[0]} is linked from another file: make an override of it first",
            )
        else:
            self.report({"INFO"}, f"Checker on {common.plural(len(shown), 'object')}")
        return {"FINISHED"} if shown else {"CANCELLED"}


class UV_OT_flipfree_remove_checker(common.PlainOperator, bpy.types.Operator):
    bl_idname = "uv.flipfree_remove_checker"
    bl_label = "Remove Checker"
    bl_description = "Take the test pattern away from all objects, and everything that came with it"

    @classmethod
    def poll(cls, context):
        there_is = any(is_checked(ob) for ob in bpy.data.objects) or shows_textures()
        return common.allowed(cls, there_is, "No object shows a checker")

    def work(self, context):
        checked = [ob for ob in bpy.data.objects if is_checked(ob)]
        for ob in checked:
            remove(ob)
        forget_unused()
        show_as_before()
        return f"Checker removed from {common.plural(len(checked), 'object')}"
