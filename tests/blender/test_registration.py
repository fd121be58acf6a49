# SPDX-License-Identifier: GPL-3.0-or-later
"""The extension as Blender sees it: operators, menus, coming and going, what it loads."""

import sys
from pathlib import Path

import bpy
import pytest

OPERATORS = [
    "flipfree_auto_seams",
    "flipfree_cut_stretched",
    "flipfree_unwrap",
    "flipfree_match",
    "flipfree_embed",
    "flipfree_improve",
    "flipfree_repair",
    "flipfree_pack",
    "flipfree_conformal",
    "flipfree_cut",
    "flipfree_seamless",
    "flipfree_field_aligned",
    "flipfree_suggest_cones",
    "flipfree_check",
    "flipfree_select_poor",
    "flipfree_select_faces",
    "flipfree_set_density",
    "flipfree_orient",
    "flipfree_rectify",
]


@pytest.mark.parametrize("name", OPERATORS)
def test_operators_are_there_with_undo_and_a_redo_panel(name, addon):
    rna = getattr(bpy.ops.uv, name).get_rna_type()
    assert rna.description
    cls = getattr(bpy.types, f"UV_OT_{name}")
    assert cls.bl_options == {"REGISTER", "UNDO"}


@pytest.mark.parametrize("name", OPERATORS)
def test_options_of_shared_classes_reach_blender(name, addon):
    """Properties may be declared in plain base classes; what the redo panel draws is there, and described."""
    properties = getattr(bpy.ops.uv, name).get_rna_type().properties
    own = {p.identifier for p in properties if p.identifier != "rna_type"}
    assert all(properties[identifier].description for identifier in own - {"rest", "boundary"})
    assert set(getattr(bpy.types, f"UV_OT_{name}").option_names) == own


def drawn_in(menu):
    """Names of the functions that extensions have added to a menu."""
    return [f"{f.__module__}.{f.__name__}" for f in menu._dyn_ui_initialize()]


@pytest.mark.parametrize("parent", ["VIEW3D_MT_uv_map", "IMAGE_MT_uvs", "VIEW3D_MT_object"])
def test_the_submenu_is_in_both_uv_menus_and_in_the_object_menu_once(parent, addon):
    entries = drawn_in(getattr(bpy.types, parent))
    assert entries.count(f"{addon.__name__}.ui.menus._draw") == 1


def test_every_operator_is_in_the_menu_once_with_an_icon_and_a_description(part):
    icons = bpy.types.UILayout.bl_rna.functions["operator"].parameters["icon"].enum_items
    tools = part("ui.tools").all_tools()
    registered = {
        name.replace("_OT_", ".").lower() for name in dir(bpy.types) if "_OT_flipfree_" in name
    }
    assert sorted(tool.operator for tool in tools) == sorted(registered)
    for tool in tools:
        assert tool.icon in icons and tool.icon != "NONE"
        space, name = tool.operator.split(".")
        assert getattr(getattr(bpy.ops, space), name).get_rna_type().description


def test_the_pie_menu_has_eight_operators_and_a_shortcut_that_nobody_has_set(part):
    menus = part("ui.menus")
    known = {tool.operator for tool in part("ui.tools").all_tools()}
    names = menus.VIEW3D_MT_flipfree_pie.NAMES
    assert len(set(names)) == 8 and set(names) <= known
    assert hasattr(bpy.types, "VIEW3D_MT_flipfree_pie")
    for _, item in menus._items:  # none without a window
        assert item.type == "NONE" and item.properties.name == "VIEW3D_MT_flipfree_pie"


def test_it_can_be_disabled_and_enabled_again(addon):
    addon.unregister()
    assert not [name for name in dir(bpy.types) if "flipfree" in name.lower()]
    for parent in ("VIEW3D_MT_uv_map", "IMAGE_MT_uvs", "VIEW3D_MT_object"):
        assert f"{addon.__name__}.ui.menus._draw" not in drawn_in(getattr(bpy.types, parent))
    kept = [
        function
        for name in dir(bpy.app.handlers)
        if isinstance(functions := getattr(bpy.app.handlers, name), list)
        for function in functions
        if function.__module__.startswith(addon.__name__)
    ]
    assert kept == []
    assert not [name for name in dir(bpy.types.WindowManager) if "flipfree" in name]
    addon.register()
    assert hasattr(bpy.types, "UV_OT_flipfree_unwrap")


def test_another_version_of_the_solver_is_refused(part, monkeypatch):
    import flipfree

    monkeypatch.setattr(flipfree, "__version__", "0.0.1")
    with pytest.raises(ImportError, match="Install the extension again"):
        part("solver").check_version()


def test_the_solver_comes_from_the_extensions_wheel():
    import flipfree

    home = Path(bpy.utils.user_resource("EXTENSIONS")).resolve()
    assert home in Path(flipfree.__file__).resolve().parents


@pytest.mark.skipif(not bpy.app.binary_path, reason="the package bpy: there is no Blender to start")
def test_the_solver_uses_no_library_but_glibc_and_its_own(tmp_path):
    """Seen in a process of its own: all that `import flipfree` maps beyond numpy lies in the wheel's folders."""
    import os
    import subprocess

    import flipfree

    code = f"""
import sys, numpy
from pathlib import Path
def maps():
    return {{line.split()[-1] for line in open("/proc/self/maps") if ".so" in line}}
before = maps()
sys.path.insert(0, {str(Path(flipfree.__file__).parents[1])!r})
import flipfree as ff
t = numpy.linspace(0, 1, 21)
x, y = numpy.meshgrid(t, t, indexing="ij")
v = numpy.column_stack([x.ravel(), y.ravel(), (x * y).ravel()])
a = (21 * numpy.arange(20)[:, None] + numpy.arange(20)).ravel()
f = numpy.concatenate([numpy.column_stack([a, a + 21, a + 22]), numpy.column_stack([a, a + 22, a + 1])])
assert ff.unwrap(v, f).certificate.ok
print("NEW", *sorted(maps() - before), sep="|")
"""
    script = tmp_path / "load.py"
    script.write_text(code)
    result = subprocess.run(
        [
            os.environ["FLIPFREE_BLENDER"],
            "-b",
            "--factory-startup",
            "--python-exit-code",
            "1",
            "--python",
            str(script),
        ],
        capture_output=True,
        text=True,
        check=True,
    )
    line = next(line for line in result.stdout.splitlines() if line.startswith("NEW|"))
    new = [Path(p) for p in line.split("|")[1:]]
    own = Path(flipfree.__file__).resolve().parents[1]
    foreign = [p for p in new if own not in p.parents and not is_glibc_or_python(p)]
    assert foreign == []


def is_glibc_or_python(path):
    """glibc, or a module of Python's own standard library."""
    glibc = ("libc.so", "libm.so", "libpthread", "libdl", "librt", "ld-linux")
    return path.name.startswith(glibc) or "lib-dynload" in path.parts


def test_prefixed_symbols_keep_blenders_libraries_out():
    """Blender has a GMP and more of its own loaded; ours must not be bound to them."""
    import shutil
    import subprocess

    import flipfree

    if not shutil.which("nm"):
        pytest.skip("nm is missing: install binutils")
    package = Path(flipfree.__file__).parent
    bundled = list((package.parent / "flipfree_uv.libs").iterdir())
    assert any(path.name.startswith("libgmp") for path in bundled)
    runtime = ("libstdc++", "libgcc_s", "libgomp")
    shared = {"__gmpz_init", "mpfr_init2"}
    for path in [*package.glob("_native*.so"), *bundled]:
        if path.name.startswith(runtime):
            continue
        listing = subprocess.run(
            ["nm", "-D", path], capture_output=True, text=True, check=True
        ).stdout
        names = {line.split()[-1].partition("@")[0] for line in listing.splitlines()}
        assert not names & shared, path.name


def test_nothing_is_written_into_the_extensions_folder(addon):
    folder = Path(addon.__file__).parent
    shipped = {
        "__init__.py",
        "blender_manifest.toml",
        "LICENSE",
        "checker",
        "command_line",
        "fields",
        "live",
        "meshes",
        "operators",
        "runs",
        "ui",
        "views",
        "wheels",
    }
    extra = {p.name for p in folder.iterdir()} - shipped
    assert {p for p in extra if not p.endswith(".py") and p != "__pycache__"} == set()
    assert sys.modules[addon.__name__] is addon
