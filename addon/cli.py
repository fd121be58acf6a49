# SPDX-License-Identifier: GPL-3.0-or-later
"""Batch work without a window:

    blender -b -c flipfree unwrap IN OUT [--pack] [--allow-overlaps] ...
    blender -b -c flipfree check IN

IN and OUT are .blend, .obj, .ply, .stl, .glb or .gltf files. Prints one line per object; the exit status is 0 only if every
object got its map (unwrap; otherwise nothing is written) or has nothing wrong (check).
"""

import argparse
import sys
from pathlib import Path

import bpy

from . import errors, mesh_io, modal
from .operators import check, unwrap

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
    unwrap = commands.add_parser("unwrap", help="unwrap every mesh of a file")
    unwrap.add_argument("input", type=Path)
    unwrap.add_argument("output", type=Path)
    unwrap.add_argument("--pack", action="store_true", help="pack all islands into the unit square")
    unwrap.add_argument("--margin", type=float, default=0.005, help="between packed islands")
    unwrap.add_argument(
        "--allow-overlaps", action="store_true", help="islands may overlap themselves"
    )
    unwrap.add_argument(
        "--short-cuts", action="store_true", help="do not cut closed parts along legs and fingers"
    )
    unwrap.add_argument("--ignore-pins", action="store_true")
    unwrap.add_argument("--mark-seams", action="store_true", help="mark automatic cuts as seams")
    check = commands.add_parser("check", help="certificate of every UV map of a file")
    check.add_argument("input", type=Path)
    return parser


def _solve(objects, make_task, summary) -> list[modal.Task]:
    """Solves one task per object and writes the results; prints a line for each. Returns the tasks that ended well."""
    tasks, failures = [], []
    for ob in objects:
        try:
            tasks.append(make_task(mesh_io.read(ob, only_selected=False)))
        except mesh_io.MeshProblem as problem:
            failures.append(errors.from_problem(ob.name, problem))
    run = modal.Run(tasks, failures)
    while not run.advance(1.0):
        pass
    run.finish()
    for task in run.done:
        print(f"{task.snapshot.object_name}: {summary([task])}")
    for failure in run.failures:
        print(failure, file=sys.stderr)
    return run.done


def _run(options) -> int:
    objects = {ob.data: ob for ob in _read(options.input)}.values()
    if not objects:
        print(f"{options.input}: no meshes in this file", file=sys.stderr)
        return 1
    if options.command == "check":
        done = _solve(objects, check.CheckTask, check.summary)
        return 0 if len(done) == len(objects) and all(t.certificate.ok for t in done) else 1
    done = _solve(
        objects,
        lambda snapshot: unwrap.UnwrapTask(
            snapshot,
            bijective=not options.allow_overlaps,
            cut_extremities=not options.short_cuts,
            use_pins=not options.ignore_pins,
            mark_seams=options.mark_seams,
            pack=options.pack,
            margin=options.margin,
        ),
        unwrap.summary,
    )
    if len(done) < len(objects):
        return 1
    _write(options.output)
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
