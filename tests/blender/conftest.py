# SPDX-License-Identifier: GPL-3.0-or-later
"""Fixtures of the tests that run inside Blender, against the extension as it was installed from its zip."""

import importlib
import sys
from pathlib import Path

import bpy
import pytest

# Judges and generators that the tests outside Blender use as well.
TESTS = Path(__file__).resolve().parent.parent
sys.path += [str(TESTS), str(TESTS / "python"), str(TESTS.parent / "benchmarks")]

from sampling import pytest_collection_modifyitems, pytest_configure, pytest_report_header  # noqa: E402, F401

PACKAGE = "bl_ext.user_default.flipfree_uv"


@pytest.fixture
def addon():
    """The installed extension's package; submodules through `part`."""
    return importlib.import_module(PACKAGE)


@pytest.fixture
def part():
    """part("meshes.mesh_io") is the extension's module of that name."""
    return lambda name: importlib.import_module(f"{PACKAGE}.{name}")


@pytest.fixture
def unwrapping(part):
    """unwrapping(object, ...): a run that unwraps them, along marked seams, and has not begun."""

    def run(*objects, **options):
        read, task = part("meshes.mesh_io").read, part("operators.unwrap").UnwrapTask
        options = {"seams": "given"} | options
        return part("modal").Run([task(read(ob, only_selected=False), **options) for ob in objects])

    return run


@pytest.fixture
def solved(unwrapping):
    """solved(object, ...): the same, solved and not written."""

    def run(*objects):
        run = unwrapping(*objects)
        while not run.advance(0.05):
            pass
        return run

    return run


@pytest.fixture(autouse=True)
def empty_scene():
    """Every test starts in object mode without objects."""
    if bpy.context.mode != "OBJECT":
        bpy.ops.object.mode_set(mode="OBJECT")
    for collection in (bpy.data.objects, bpy.data.meshes, bpy.data.materials):
        bpy.data.batch_remove(list(collection))
    settings = bpy.context.tool_settings
    settings.mesh_select_mode = (True, False, False)
    yield
    if bpy.context.mode != "OBJECT":
        bpy.ops.object.mode_set(mode="OBJECT")
