# SPDX-License-Identifier: GPL-3.0-or-later
"""Files of models through Blender's importers and exporters: whole scenes in, whole scenes out."""

import contextlib
import glob
import os
import shutil
from pathlib import Path

import bpy

from flipfree.batch.plan import Formats

from .merging import merge_split_vertices

# Ending -> operators of bpy.ops that import it, the newest Blender's first, and export it.
_READERS = {
    ".blend": ("wm.open_mainfile",),
    ".obj": ("wm.obj_import",),
    ".ply": ("wm.ply_import",),
    ".stl": ("wm.stl_import",),
    ".glb": ("import_scene.gltf",),
    ".gltf": ("import_scene.gltf",),
    ".fbx": ("wm.fbx_import", "import_scene.fbx"),
    **dict.fromkeys((".usd", ".usda", ".usdc", ".usdz"), ("wm.usd_import",)),
}
_WRITERS = {
    ".blend": ("wm.save_as_mainfile",),
    ".obj": ("wm.obj_export",),
    ".ply": ("wm.ply_export",),
    ".glb": ("export_scene.gltf",),
    ".gltf": ("export_scene.gltf",),
    ".fbx": ("wm.fbx_export", "export_scene.fbx"),
    **dict.fromkeys((".usd", ".usda", ".usdc", ".usdz"), ("wm.usd_export",)),
}
_OPTIONS = {
    "wm.open_mainfile": {"load_ui": False},
    "wm.save_as_mainfile": {"copy": True, "compress": True},
}
_FORMATS = {".glb": {"export_format": "GLB"}, ".gltf": {"export_format": "GLTF_SEPARATE"}}


def _operator(names):
    """The first that this Blender has; some are built without USD."""
    for name in names:
        module, _, function = name.partition(".")
        operator = getattr(getattr(bpy.ops, module), function)
        with contextlib.suppress(KeyError):
            operator.get_rna_type()
            return operator, _OPTIONS.get(name, {})
    return None


def formats() -> Formats:
    """What this Blender reads and writes."""
    reads, writes = (
        tuple(ending for ending, names in table.items() if _operator(names))
        for table in (_READERS, _WRITERS)
    )
    return Formats(reads, writes)


def read(path: Path, *, merge: bool) -> list:
    """Loads a file into an empty scene; returns its mesh objects, one per mesh.

    merge: vertices that the file has twice become one; .blend files are taken as they are. Raises ValueError for files of
    other types, RuntimeError for what Blender cannot read.
    """
    ending = path.suffix.lower()
    found = _operator(_READERS.get(ending, ()))
    if found is None:
        raise ValueError(
            f"{path}: files of this type cannot be read. Use {', '.join(formats().reads)}"
        )
    operator, options = found
    if ending != ".blend":
        bpy.ops.wm.read_homefile(use_empty=True)
    operator(filepath=str(path), **options)
    objects = [ob for ob in bpy.context.scene.objects if ob.type == "MESH"]
    unique = list({ob.data: ob for ob in objects}.values())
    if merge and ending != ".blend":
        for ob in unique:
            merge_split_vertices(ob.data)
    return unique


def write(path: Path) -> None:
    """Writes the scene: the file and what an exporter puts beside it are there as a whole or not at all."""
    ending = path.suffix.lower()
    found = _operator(_WRITERS.get(ending, ()))
    if found is None:
        raise ValueError(
            f"{path}: UVs cannot be written to files of this type. Use {', '.join(formats().writes)}"
        )
    operator, options = found
    path.parent.mkdir(parents=True, exist_ok=True)
    _clear(path)
    if ending == ".blend":  # its paths are relative to where it lies
        part = path.with_name(f".{path.name}.{os.getpid()}.part.blend")
        try:
            operator(filepath=str(part), **options)
            part.replace(path)
        finally:
            part.unlink(missing_ok=True)
        return
    folder = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        folder.mkdir()
        operator(filepath=str(folder / path.name), **options, **_FORMATS.get(ending, {}))
        _move(folder, path)
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def _move(folder: Path, path: Path) -> None:
    """What lies beside the file (.mtl, .bin, textures) first."""
    main = folder / path.name
    if not main.is_file():
        raise RuntimeError(f"{path}: Blender's exporter wrote nothing")
    for other in sorted(folder.rglob("*")):
        if other.is_file() and other != main:
            place = path.parent / other.relative_to(folder)
            place.parent.mkdir(parents=True, exist_ok=True)
            other.replace(place)
    main.replace(path)


def _clear(path: Path) -> None:
    """Takes away what a killed process left."""
    for left in path.parent.glob(f".{glob.escape(path.name)}.*.part*"):
        shutil.rmtree(left, ignore_errors=True) if left.is_dir() else left.unlink(missing_ok=True)
