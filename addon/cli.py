# SPDX-License-Identifier: GPL-3.0-or-later
"""Batch work without a window:

    blender -b -c flipfree unwrap IN OUT [--keep-placement] [--allow-overlaps] ...
    blender -b -c flipfree match IN OUT [--cut-open] [--unwrap-rest] [--max-seconds S] ...
    blender -b -c flipfree improve IN OUT [--pack] [--iterations N] ...
    blender -b -c flipfree pack IN OUT [--margin-pixels P] [--texture-size S] [--rotation quarters] ...
    blender -b -c flipfree conformal IN OUT [--boundary straight] ...
    blender -b -c flipfree seamless IN OUT [--cones suggested] ...
    blender -b -c flipfree field-aligned IN OUT [--field flow] ...
    blender -b -c flipfree check IN

    ... --json FILE     one record per object with the numbers of its certificate, `poor`, warnings and errors; - is stdout

IN and OUT are .blend, .obj, .ply, .glb or .gltf files, IN also .stl; pins, vertex groups and cones come with .blend only. Prints
one line per object; the exit status is 0 only if every object got its map (otherwise nothing is written) or has nothing wrong
(check).
"""

import argparse
import sys
from pathlib import Path

import bpy

from . import errors, modal, records
from .fields import arguments as field_arguments
from .meshes import mesh_io
from .operators import (
    check,
    common,
    conformal,
    improve,
    layout,
    match,
    seamless,
    unwrap,
)
from .operators.options import MAX_SECONDS
from .operators.packing import pack

_handles = []


def _read(path: Path) -> list:
    """Loads a file into an empty scene; returns its mesh objects."""
    suffix = path.suffix.lower()
    if suffix == ".blend":
        bpy.ops.wm.open_mainfile(filepath=str(path))
    else:
        readers = {
            ".obj": bpy.ops.wm.obj_import,
            ".ply": bpy.ops.wm.ply_import,
            ".stl": bpy.ops.wm.stl_import,
            ".glb": bpy.ops.import_scene.gltf,
            ".gltf": bpy.ops.import_scene.gltf,
        }
        if suffix not in readers:
            raise ValueError(
                f"{path}: files of this type cannot be read. Use .blend, {', '.join(readers)}"
            )
        bpy.ops.wm.read_homefile(use_empty=True)
        readers[suffix](filepath=str(path))
    return [ob for ob in bpy.context.scene.objects if ob.type == "MESH"]


def _write(path: Path) -> None:
    suffix = path.suffix.lower()
    if suffix == ".blend":
        bpy.ops.wm.save_as_mainfile(filepath=str(path))
        return
    writers = {
        ".obj": bpy.ops.wm.obj_export,
        ".ply": bpy.ops.wm.ply_export,
        ".glb": bpy.ops.export_scene.gltf,
        ".gltf": bpy.ops.export_scene.gltf,
    }
    if suffix not in writers:
        raise ValueError(
            f"{path}: UVs cannot be written to files of this type. Use .blend, {', '.join(writers)}"
        )
    writers[suffix](filepath=str(path))


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="blender -b -c flipfree", description="Flip-free UV maps in batches"
    )
    commands = parser.add_subparsers(dest="command", required=True)

    def command(name, text, make_options):
        added = commands.add_parser(name, help=text)
        added.add_argument("input", type=Path)
        added.add_argument("output", type=Path)
        _json(added)
        added.set_defaults(options=make_options)
        return added

    def flags(added, **texts):
        for name, text in texts.items():
            added.add_argument(f"--{name.replace('_', '-')}", action="store_true", help=text)

    overlaps = "islands may overlap themselves"
    added = command("unwrap", "unwrap every mesh of a file", _unwrap_options)
    flags(
        added,
        keep_placement="islands stay where they were, if that is a usable layout; otherwise all are packed",
        allow_overlaps=overlaps,
        no_new_cuts="crush islands that would lie on top of themselves rather than cut them",
        short_cuts="do not cut closed parts along legs and fingers",
        ignore_pins="treat pinned UVs as any other",
        mark_seams="mark automatic cuts as seams",
    )
    _margin(added)
    added = command("match", "meet the pins of every mesh exactly", _match_options)
    flags(
        added,
        allow_overlaps=overlaps,
        bend_lines="edges between two pins may bend where triangles are subdivided",
        cut_open="cut pinned islands open that are closed or have handles",
        unwrap_rest="unwrap islands without pins; otherwise they stay",
        no_new_vertices="refuse pins that cannot be met by the mesh as it is",
    )
    added.add_argument(
        "--max-seconds",
        type=_seconds,
        default=MAX_SECONDS,
        help="most per island, 0 for no limit (default %(default)g)",
    )
    added = command("improve", "less distortion for maps without flips", _improve_options)
    flags(
        added,
        pack="pack all islands into the unit square",
        allow_overlaps=overlaps,
        ignore_pins="treat pinned UVs as any other",
    )
    added.add_argument("--iterations", type=int, default=200, help="most steps per island")
    _margin(added)
    added = command("pack", "nest the islands of all meshes into one tile", _pack_options)
    added.add_argument("--margin-pixels", type=float, default=2.0, help="least gap between islands")
    added.add_argument("--texture-size", type=int, default=1024, help="pixels to a side")
    added.add_argument(
        "--rotation", choices=[name for name, _, _ in pack.ROTATIONS], default="free"
    )
    added.add_argument("--tile", type=int, default=1001, help="UDIM tile to pack into")
    added.add_argument(
        "--effort", type=float, default=1.0, help="of the search (default %(default)g)"
    )
    flags(
        added,
        keep_sizes="islands keep their sizes relative to each other, not one texel density",
        stack_similar="islands of equal outline lie on top of each other",
        ignore_pins="treat pinned UVs as any other",
    )
    added = command("conformal", "map without shear, with the marked cones", _conformal_options)
    boundaries = [name for name, _, _ in conformal.BOUNDARIES]
    added.add_argument("--boundary", choices=boundaries, default="free")
    added.add_argument(
        "--refined-start",
        choices=[name for name, _, _ in conformal.REFINED_STARTS],
        default="auto",
        help="compute the metric on a surface without needles",
    )
    flags(
        added,
        no_seams="do not mark the cuts as seams",
        no_pack="leave islands where the layout puts them",
        metric_scale="pack parts in the size of their metric, not of their surface",
    )
    _margin(added)
    added = command("seamless", "seams that match by quarter turns", _seamless_options)
    added.add_argument(
        "--cones",
        choices=[name for name, _, _ in seamless.CONES],
        default="auto",
        help="marked ones, suggested ones, or suggested where none are marked (auto)",
    )
    added.add_argument(
        "--bound",
        type=float,
        default=2.0,
        help="of the scale, for suggested cones (default %(default)g)",
    )
    added.add_argument(
        "--boundary",
        choices=[name for name, _, _ in seamless.BOUNDARIES],
        default="aligned",
        help="boundaries along u and v, or free",
    )
    added.add_argument(
        "--engine", choices=[name for name, _, _ in seamless.ENGINES], default="auto"
    )
    flags(
        added,
        no_optimise="leave the distortion as the engine does",
        no_seams="do not mark the cuts as seams, nor their quarter turns",
        no_cones="do not mark suggested cones",
        surface_scale="one UV unit is one unit of the object; otherwise the map fits the unit square",
    )
    added = command("field-aligned", "a seamless map along a field", field_arguments.options)
    field_arguments.add_arguments(added)
    added = commands.add_parser("check", help="certificate of every UV map of a file")
    added.add_argument("input", type=Path)
    added.add_argument("--allow-stacked", action="store_true", help="islands may lie on each other")
    _json(added)
    return parser


def _json(added):
    added.add_argument(
        "--json", metavar="FILE", help="write one record per object there; - is the standard output"
    )


def _seconds(text):
    seconds = float(text)
    if not 0.0 <= seconds < float("inf"):
        raise ValueError(text)
    return seconds


def _margin(added):
    added.add_argument("--margin", type=float, default=0.005, help="between packed islands")


# Arguments -> (task maker, summary, options of the task).
def _unwrap_options(given):
    return (
        unwrap.UnwrapTask,
        unwrap.summary,
        {
            "bijective": not given.allow_overlaps,
            "may_add_cuts": not given.no_new_cuts,
            "cut_extremities": not given.short_cuts,
            "use_pins": not given.ignore_pins,
            "mark_seams": given.mark_seams,
            "keep_placement": given.keep_placement,
            "margin": given.margin,
        },
    )


def _match_options(given):
    return (
        match.make_task,
        match.summary,
        {
            "bijective": not given.allow_overlaps,
            "straight_lines": not given.bend_lines,
            "cut_open": given.cut_open,
            "rest": "unwrap" if given.unwrap_rest else "keep",
            "may_add": not given.no_new_vertices,
            "max_seconds": given.max_seconds,
        },
    )


def _improve_options(given):
    return (
        improve.ImproveTask,
        improve.summary,
        {
            "bijective": not given.allow_overlaps,
            "use_pins": not given.ignore_pins,
            "iterations": given.iterations,
            "pack": given.pack,
            "margin": given.margin,
        },
    )


def _pack_options(given):
    return (
        pack.PackTask,
        pack.summary,
        {
            "margin_pixels": given.margin_pixels,
            "texture_size": given.texture_size,
            "rotation": given.rotation,
            "stack_similar": given.stack_similar,
            "same_density": not given.keep_sizes,
            "use_pins": not given.ignore_pins,
            "tile": given.tile,
            "effort": given.effort,
        },
    )


def _conformal_options(given):
    return (
        conformal.make_task,
        conformal.summary,
        {
            "boundary": given.boundary,
            "refined_start": given.refined_start,
            "mark_cuts": not given.no_seams,
            "pack": not given.no_pack,
            "scale_true": not given.metric_scale,
            "margin": given.margin,
        },
    )


def _seamless_options(given):
    return (
        seamless.make_task,
        seamless.summary,
        {
            "cones_from": given.cones,
            "boundary": given.boundary,
            "bound": given.bound,
            "optimise": not given.no_optimise,
            "mark_cuts": not given.no_seams,
            "mark_cones": not given.no_cones,
            "fit": not given.surface_scale,
            "engine": given.engine,
        },
    )


def _solve(objects, make_task, summary, *, advice=common.advice, to_json=None) -> list[modal.Task]:
    """Solves one task per object and writes the results; prints a line for each, or records. Returns the tasks that ended
    well."""
    tasks, failures = [], []
    for ob in objects:
        try:
            tasks.append(make_task(mesh_io.read(ob, only_selected=False)))
        except mesh_io.MeshProblem as problem:
            failures.append(errors.from_problem(ob.name, problem))
    run = modal.Run(tasks, failures, layout=layout.joint)
    while not run.advance(1.0):
        pass
    run.finish()
    found = []
    for task in run.done:
        line, warning = summary([task]), advice([task])
        found.append(records.of_task(task, line, warning))
        if to_json != "-":
            text = f"{line}. Warning: {warning}" if warning else line
            print(f"{task.snapshot.object_name}: {text}")
    for failure in run.failures:
        found.append(records.of_failure(failure))
        print(failure, file=sys.stderr)
    if to_json:
        records.write(found, to_json)
    return run.done


def _run(options) -> int:
    objects = {ob.data: ob for ob in _read(options.input)}.values()
    if not objects:
        print(f"{options.input}: no meshes in this file", file=sys.stderr)
        return 1
    if options.command == "check":
        stacked = {"stacked_ok": options.allow_stacked}
        done = _solve(
            objects,
            lambda snapshot: check.CheckTask(snapshot, **stacked),
            check.summary,
            advice=check.advice,
            to_json=options.json,
        )
        return 0 if len(done) == len(objects) and all(t.certificate.ok for t in done) else 1
    make_task, summary, values = options.options(options)
    done = _solve(
        objects, lambda snapshot: make_task(snapshot, **values), summary, to_json=options.json
    )
    if len(done) < len(objects):
        return 1
    _write(options.output)
    if options.json != "-":
        print(f"Written: {options.output}")
    return 0


def main(arguments: list[str]) -> int:
    """The command; returns its exit status."""
    try:
        options = _parser().parse_args(arguments)
    except SystemExit as stop:  # argparse has said why
        return int(stop.code or 0)
    try:
        return _run(options)
    except (ValueError, RuntimeError, OSError) as error:
        print(str(error).strip(), file=sys.stderr)
        return 1


def register():
    _handles.append(bpy.utils.register_cli_command("flipfree", main))


def unregister():
    while _handles:
        bpy.utils.unregister_cli_command(_handles.pop())
