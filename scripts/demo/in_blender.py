# SPDX-License-Identifier: GPL-3.0-or-later
"""The demo's part inside Blender: models, Auto Unwrap through its operator, Smart UV Project beside it, renderings.

    blender -b --python in_blender.py -- OUT_FOLDER [MESH | sheet]

Without MESH a model of each kind is made: Blender's monkey, a part with bevelled edges, and a scan-like bust: voxel-remeshed,
with the noise of a scanner, open at the neck. sheet: these, primitives, text, a character and more (picture.py draws all).
For every model NAME: OUT_FOLDER/NAME.npz, NAME_smart.png and NAME_auto.png.
"""

import sys
import time
from collections.abc import Callable
from pathlib import Path

import bpy
import numpy as np
from mathutils import Vector

TOP = 2.0  # of the distortion scale
FIELDS = 18  # of the checker, along a model
TESTS = Path(__file__).resolve().parents[2] / "tests"
# Colours of the distortion scale, from none to much.
SCALE = np.array(
    [
        [0.84, 0.87, 0.90],
        [0.99, 0.86, 0.55],
        [0.97, 0.55, 0.29],
        [0.80, 0.19, 0.25],
        [0.35, 0.05, 0.35],
    ]
)


def monkey() -> bpy.types.Object:
    bpy.ops.mesh.primitive_monkey_add(size=2.0)
    return bpy.context.object


def part() -> bpy.types.Object:
    """A bevelled bracket: a plate and a wall with a round hole in each."""
    bpy.ops.mesh.primitive_cube_add(size=1.0)
    ob = bpy.context.object
    ob.name = "Bracket"
    ob.scale = (2.0, 1.4, 0.3)
    bpy.ops.object.transform_apply(scale=True)
    tools = []
    for union, place, size, turn in (
        (True, (-0.85, 0.0, 0.6), (0.3, 1.4, 1.0), None),
        (False, (0.4, 0.0, 0.0), (0.36, 0.36, 1.0), (0.0, 0.0, 0.0)),
        (False, (-0.85, 0.0, 0.65), (0.26, 0.26, 1.0), (0.0, np.pi / 2, 0.0)),
    ):
        if turn is None:
            bpy.ops.mesh.primitive_cube_add(size=1.0, location=place)
        else:
            bpy.ops.mesh.primitive_cylinder_add(
                vertices=32, radius=1.0, depth=1.0, location=place, rotation=turn
            )
        tool = bpy.context.object
        tool.scale = size
        cut = ob.modifiers.new("Cut", "BOOLEAN")
        cut.operation, cut.object = ("UNION" if union else "DIFFERENCE"), tool
        tools.append(tool)
    bevel = ob.modifiers.new("Bevel", "BEVEL")
    bevel.width, bevel.segments, bevel.limit_method = 0.04, 2, "ANGLE"
    bpy.context.view_layer.objects.active = ob
    for modifier in [m.name for m in ob.modifiers]:
        bpy.ops.object.modifier_apply(modifier=modifier)
    for tool in tools:
        bpy.data.objects.remove(tool)
    return ob


def bust() -> bpy.types.Object:
    bpy.ops.mesh.primitive_monkey_add(size=2.0)
    ob = bpy.context.object
    ob.name = "Bust"
    smooth = ob.modifiers.new("Smooth", "SUBSURF")
    smooth.levels = 3
    bpy.ops.object.modifier_apply(modifier=smooth.name)
    ob.data.remesh_voxel_size = 0.021
    bpy.ops.object.voxel_remesh()
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="SELECT")
    # Closed bubbles inside, as scans have them too, go; the head stays.
    bpy.ops.mesh.select_all(action="DESELECT")
    bpy.ops.mesh.select_mode(type="VERT")
    import bmesh

    bm = bmesh.from_edit_mesh(ob.data)
    max(bm.verts, key=lambda v: v.co.x).select_set(True)
    bpy.ops.mesh.select_linked()
    bpy.ops.mesh.select_all(action="INVERT")
    bpy.ops.mesh.delete(type="VERT")
    bpy.ops.mesh.select_all(action="SELECT")
    bpy.ops.mesh.bisect(plane_co=(0, 0, -0.80), plane_no=(0, 0, 1), clear_inner=True)
    bpy.ops.mesh.select_all(action="SELECT")
    bpy.ops.mesh.quads_convert_to_tris()
    bpy.ops.object.mode_set(mode="OBJECT")
    # A scanner's noise: every point a little off along its normal, the same on every machine.
    normals = np.array([v.normal for v in ob.data.vertices])
    co = np.array([v.co for v in ob.data.vertices])
    noise = np.random.default_rng(7).normal(0.0, 0.0016, (len(co), 1))
    ob.data.vertices.foreach_set("co", (co + noise * normals).astype(np.float32).ravel())
    ob.data.update()
    return ob


def character() -> bpy.types.Object:
    """A body of limbs by the skin modifier, as box modelling leaves it: quads, symmetric."""
    half = [(0.22, 0.0, 1.45), (0.62, 0.0, 1.4), (1.0, 0.05, 1.3)]  # an arm
    half += [(0.14, 0.0, 0.78), (0.18, -0.03, 0.4), (0.18, 0.0, 0.05), (0.2, -0.22, 0.0)]  # a leg
    points = [(0.0, 0.0, 0.95), (0.0, 0.0, 1.45), (0.0, 0.0, 1.62), (0.0, -0.02, 1.85)]
    edges = [(0, 1), (1, 2), (2, 3)]
    thick = [0.17, 0.17, 0.06, 0.14]
    for side in (-1, 1):
        n = len(points)
        points += [(side * x, y, z) for x, y, z in half]
        edges += [(1, n), (n, n + 1), (n + 1, n + 2)]
        edges += [(0, n + 3), (n + 3, n + 4), (n + 4, n + 5), (n + 5, n + 6)]
        thick += [0.09, 0.07, 0.06, 0.11, 0.09, 0.07, 0.05]
    mesh = bpy.data.meshes.new("Character")
    mesh.from_pydata(points, edges, [])
    ob = bpy.data.objects.new("Character", mesh)
    bpy.context.collection.objects.link(ob)
    bpy.context.view_layer.objects.active = ob
    ob.modifiers.new("Skin", "SKIN")
    for vertex, radius in zip(mesh.skin_vertices[0].data, thick, strict=True):
        vertex.radius = (radius, radius)
    mesh.skin_vertices[0].data[0].use_root = True
    ob.modifiers.new("Smooth", "SUBSURF").levels = 2
    for name in ("Skin", "Smooth"):
        bpy.ops.object.modifier_apply(modifier=name)
    return ob


def made(name: str) -> Callable[[], bpy.types.Object]:
    """One of tests/blender/all_objects.py."""

    def make() -> bpy.types.Object:
        sys.path[:0] = [str(TESTS / "python"), str(TESTS), str(TESTS / "blender")]
        from all_objects import OBJECTS

        OBJECTS[name]()
        bpy.context.object.name = name.capitalize()
        return bpy.context.object

    return make


SHEET = "cube;UV sphere;cylinder;cone;torus;text, thick;Bezier tube;union;solid monkey".split(";")


def load(path: Path) -> bpy.types.Object:
    readers = {
        ".obj": bpy.ops.wm.obj_import,
        ".ply": bpy.ops.wm.ply_import,
        ".stl": bpy.ops.wm.stl_import,
        ".glb": bpy.ops.import_scene.gltf,
    }
    if path.suffix.lower() == ".blend":
        bpy.ops.wm.open_mainfile(filepath=str(path))
    elif path.suffix.lower() in readers:
        readers[path.suffix.lower()](filepath=str(path))
    else:
        sys.exit(f"{path}: not a file that this demo can read (.blend, {', '.join(readers)})")
    meshes = [ob for ob in bpy.context.scene.objects if ob.type == "MESH"]
    if not meshes:
        sys.exit(f"{path}: no mesh in this file")
    return max(meshes, key=lambda ob: len(ob.data.polygons))


def stored_triangles(mesh):
    """(m, 3, 3) positions, (m, 3, 2) stored UVs, (m, 3) vertices."""
    mesh.calc_loop_triangles()
    loops = np.array([t.loops for t in mesh.loop_triangles])
    corners = np.array([t.vertices for t in mesh.loop_triangles])
    co = np.array([v.co for v in mesh.vertices])
    uv = np.empty((len(mesh.loops), 2), np.float32)
    mesh.uv_layers.active.uv.foreach_get("vector", uv.ravel())
    return co[corners], uv[loops].astype(float), corners


def distortions(points: np.ndarray, uv: np.ndarray) -> np.ndarray:
    """(|J|^2 + |J^-1|^2) / 4 per triangle, at the best global scale; 1 = isometric."""
    e1, e2 = points[:, 1] - points[:, 0], points[:, 2] - points[:, 0]
    x1 = np.linalg.norm(e1, axis=1)
    x2 = (e1 * e2).sum(axis=1) / x1
    y2 = np.linalg.norm(np.cross(e1, e2), axis=1) / x1
    f1, f2 = uv[:, 1] - uv[:, 0], uv[:, 2] - uv[:, 0]
    a = f1 / x1[:, None]
    b = (f2 - a * x2[:, None]) / y2[:, None]
    norm = (a**2).sum(axis=1) + (b**2).sum(axis=1)
    det = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    area = 0.5 * x1 * y2
    inverse = norm / det**2
    scale2 = np.sqrt(np.nansum(area * inverse) / np.nansum(area * norm))
    return 0.25 * (norm * scale2 + inverse / scale2)


def colours(values: np.ndarray, top: float) -> np.ndarray:
    """(m, 3) on a logarithmic scale from 1 to `top`; what has no area has no distortion."""
    values = np.where(np.isfinite(values), values, 1.0)
    t = np.clip(np.log(values) / np.log(top), 0.0, 1.0) * (len(SCALE) - 1)
    i = np.minimum(t.astype(int), len(SCALE) - 2)
    return SCALE[i] + (t - i)[:, None] * (SCALE[i + 1] - SCALE[i])


def checker(scale: float) -> bpy.types.Material:
    result = bpy.data.materials.new("Checker")
    result.use_nodes = True
    nodes, links = result.node_tree.nodes, result.node_tree.links
    shader = next(n for n in nodes if n.type == "BSDF_PRINCIPLED")
    shader.inputs["Roughness"].default_value = 0.65
    coordinates = nodes.new("ShaderNodeUVMap")
    pattern = nodes.new("ShaderNodeTexChecker")
    pattern.inputs["Scale"].default_value = scale
    pattern.inputs["Color1"].default_value = (0.90, 0.91, 0.93, 1.0)
    pattern.inputs["Color2"].default_value = (0.06, 0.20, 0.42, 1.0)
    links.new(coordinates.outputs["UV"], pattern.inputs["Vector"])
    links.new(pattern.outputs["Color"], shader.inputs["Base Color"])
    return result


def studio(ob) -> None:
    """Camera, light and Cycles on the processor: Blender's other engines want a graphics card."""
    scene = bpy.context.scene
    for other in list(bpy.data.objects):
        if other.type in {"CAMERA", "LIGHT"} or (other.type == "MESH" and other is not ob):
            bpy.data.objects.remove(other)
    corners = np.array([ob.matrix_world @ v.co for v in ob.data.vertices])
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    towards = Vector((0.55, -1.0, 0.32)).normalized()
    camera.rotation_euler = (-towards).to_track_quat("-Z", "Y").to_euler()
    # The picture's frame: the model's extent seen from there, with a small border.
    axes = np.array(camera.rotation_euler.to_matrix()).T
    seen = corners @ axes.T
    low, high = seen.min(axis=0), seen.max(axis=0)
    distance = float(np.ptp(corners, axis=0).max())
    camera.location = axes.T @ np.append(0.5 * (low + high)[:2], high[2] + distance)
    camera.data.type = "ORTHO"
    camera.data.ortho_scale = 1.04 * float((high - low)[:2].max())
    camera.data.clip_end = 10 * distance
    scene.collection.objects.link(camera)
    scene.camera = camera

    for energy, where in ((2.6, (-0.5, -1.0, 1.1)), (0.9, (1.2, -0.6, 0.3))):
        light = bpy.data.objects.new("Sun", bpy.data.lights.new("Sun", "SUN"))
        light.data.energy = energy
        light.data.angle = 0.25
        light.rotation_euler = Vector(-np.array(where)).to_track_quat("-Z", "Y").to_euler()
        scene.collection.objects.link(light)
    world = bpy.data.worlds.new("World")
    world.use_nodes = True
    world.node_tree.nodes["Background"].inputs[0].default_value = (1, 1, 1, 1)
    world.node_tree.nodes["Background"].inputs[1].default_value = 0.45
    scene.world = world
    scene.render.engine = "CYCLES"
    scene.cycles.device = "CPU"
    scene.cycles.samples = 24
    scene.cycles.use_denoising = False
    scene.cycles.seed = 0
    scene.render.resolution_x = scene.render.resolution_y = 620
    scene.render.film_transparent = True
    scene.view_settings.view_transform = "Standard"


def shown(ob, path: Path) -> dict:
    """Renders a checker whose fields have the same size on every map of the model; what is stored of the map."""
    mesh = ob.data
    points, uv, corners = stored_triangles(mesh)
    value = distortions(points, uv)
    e, f = points[:, 1:] - points[:, :1], uv[:, 1:] - uv[:, :1]
    area = 0.5 * np.linalg.norm(np.cross(e[:, 0], e[:, 1]), axis=1).sum()
    covered = 0.5 * np.abs(f[:, 0, 0] * f[:, 1, 1] - f[:, 0, 1] * f[:, 1, 0]).sum()
    extent = float(np.ptp(points.reshape(-1, 3), axis=0).max())
    mesh.materials.clear()
    mesh.materials.append(checker(2 * FIELDS / extent * np.sqrt(area / covered)))
    mesh.polygons.foreach_set("material_index", np.zeros(len(mesh.polygons), np.int32))
    bpy.context.scene.render.filepath = str(path)
    bpy.ops.render.render(write_still=True)
    return dict(uv=uv, corners=corners, value=value, colour=colours(value, TOP))


def certificate_of(mesh: bpy.types.Mesh):
    """Of what is stored now, by the package."""
    import flipfree

    _, uv, corners = stored_triangles(mesh)
    vertices = np.array([v.co for v in mesh.vertices], dtype=float)
    return flipfree.certify(vertices, corners.astype(np.int32), uv, bijective=True)


def run(ob, out: Path) -> bool:
    """One model, by Smart UV Project and by Auto Unwrap, each with its defaults; is the second certified?"""
    for other in bpy.context.view_layer.objects:
        other.select_set(other is ob)
    bpy.context.view_layer.objects.active = ob
    print(f"{ob.name}: {len(ob.data.vertices)} vertices, {len(ob.data.polygons)} faces", flush=True)
    studio(ob)
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="SELECT")
    bpy.ops.uv.smart_project()
    bpy.ops.object.mode_set(mode="OBJECT")
    smart = shown(ob, out / f"{ob.name}_smart.png")

    started = time.perf_counter()
    if bpy.ops.uv.flipfree_unwrap() != {"FINISHED"}:
        sys.exit("The mesh was not unwrapped: see above.")
    seconds = time.perf_counter() - started
    certificate = certificate_of(ob.data)
    print(certificate, flush=True)
    auto = shown(ob, out / f"{ob.name}_auto.png")
    np.savez(
        out / f"{ob.name}.npz",
        **{f"smart_{key}": value for key, value in smart.items()},
        **{f"auto_{key}": value for key, value in auto.items()},
        top=TOP,
        scale=SCALE,
        certificate=str(certificate),
        seconds=seconds,
        blender=bpy.app.version_string,
    )
    return certificate.ok


def main() -> None:
    out, *mesh = sys.argv[sys.argv.index("--") + 1 :]
    kinds = [monkey, part, bust]
    if mesh == ["sheet"]:
        kinds += [character, *map(made, SHEET)]
    elif mesh:
        kinds = [lambda: load(Path(mesh[0]))]
    if len(kinds) > 1:
        bpy.ops.wm.read_homefile(use_empty=True)
    for make in kinds:
        if not run(make(), Path(out)):
            sys.exit("The stored map is not what was certified.")


main()
