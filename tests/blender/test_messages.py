# SPDX-License-Identifier: GPL-3.0-or-later
"""What our messages name is there: operators and options as Blender shows them, in words that its status bar can show."""

import ast
import inspect
import re
from pathlib import Path

import bpy
import numpy as np
import pytest
import shapes


def texts(addon):
    """(file, text) of every string of the extension but documentation and annotations' code."""
    for path in sorted(Path(inspect.getfile(addon)).parent.rglob("*.py")):
        tree = ast.parse(path.read_text(encoding="utf-8"))
        docs = {
            id(node.body[0].value)
            for node in ast.walk(tree)
            if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef)
            and node.body
            and isinstance(node.body[0], ast.Expr)
        }
        for node in ast.walk(tree):
            if isinstance(node, ast.JoinedStr):
                yield (
                    path.name,
                    "".join(
                        part.value if isinstance(part, ast.Constant) else "0"
                        for part in node.values
                    ),
                )
            elif isinstance(node, ast.Constant) and isinstance(node.value, str):
                if id(node) not in docs:
                    yield path.name, node.value


def labels():
    """{name of an option: names of its values} of all our operators, and their own names."""
    options, names = {}, set()
    for space in (bpy.ops.uv, bpy.ops.mesh):
        for name in dir(space):
            if not name.startswith("flipfree"):
                continue
            rna = getattr(space, name).get_rna_type()
            names.add(rna.name)
            for prop in rna.properties:
                values = {item.name for item in prop.enum_items} if prop.type == "ENUM" else set()
                options.setdefault(prop.name, set()).update(values)
    return options, names


def test_options_that_messages_name_are_there_under_that_name(addon):
    options, _ = labels()
    seen = 0
    for name, text in texts(addon):
        for option, value in re.findall(
            r"(?<!\w)'([A-Z][a-z]+(?: [A-Z][a-z]+)*)(?:: ([A-Z][a-z]+))?'", text
        ):
            assert option in options, (name, option)
            assert not value or any(value in known for known in options[option]), (name, value)
            seen += 1
    assert seen > 5, "there are such"


OPERATOR = (
    "Repair Flips|Auto Unwrap|Select Stretched Islands|Select Where It Failed|Suggest Cones|Mark Cone|Clear Cones|"
    "Auto Seams|Match Pins"
)


def test_operators_that_messages_name_are_there_under_that_name(addon):
    _, names = labels()
    named = {found for _, text in texts(addon) for found in re.findall(OPERATOR, text)}
    assert {"Repair Flips", "Auto Unwrap", "Select Stretched Islands"} <= named
    assert named <= names, named - names


def test_check_of_flips_names_repair_first_and_it_mends_them(capfd):
    ob = shapes.grid(6, uv=True)
    at = shapes.plane(ob)
    uv = ((at + 1) / 3).astype(np.float32)
    uv[shapes.corners(ob) == 24] += np.float32([0.3, 0.0])  # beyond its neighbours
    shapes.set_uv(ob, uv)
    assert bpy.ops.uv.flipfree_check() == {"FINISHED"}
    said = capfd.readouterr().out
    assert said.index("Repair Flips mends them") < said.index("Auto Unwrap makes a new one")
    assert bpy.ops.uv.flipfree_repair() == {"FINISHED"}
    capfd.readouterr()
    assert bpy.ops.uv.flipfree_check() == {"FINISHED"}
    assert "0 flips, 0 overlaps" in capfd.readouterr().out


@pytest.mark.parametrize("density", [None, np.ones(3)])
def test_a_field_map_that_stretches_blames_a_density_only_where_one_was_given(density, part):
    from types import SimpleNamespace

    task = part("fields.field_aligned").FieldAlignedTask
    cure = task.poor_cure.fget(SimpleNamespace(given=SimpleNamespace(sizing=density)))
    assert ("density" in cure) == (density is not None) and "Subdivide" in cure


@pytest.mark.parametrize("seams", ["auto", "given"])
def test_the_cure_of_a_stretched_unwrap_works_from_where_the_user_is(seams, capfd):
    bpy.ops.mesh.primitive_monkey_add()
    assert bpy.ops.uv.flipfree_unwrap(seams=seams, stretch=3.0) == {"FINISHED"}
    said = capfd.readouterr().out
    if seams == "given":
        assert "'Seams: Automatic' cuts there" in said
    elif "stretched" in said:
        assert "A lower 'Stretch' cuts there" in said
    assert bpy.ops.uv.flipfree_unwrap(seams="auto", stretch=1.25) == {"FINISHED"}
    assert "stretched" not in capfd.readouterr().out


def test_the_status_bar_gets_no_more_than_it_has_room_for(part):
    errors = part("errors")
    clauses = [f"{n} islands, 0 flips; the rest. And more" for n in range(30)]
    for count in range(1, 31):
        text = ", ".join(clauses[:count])
        line = errors.for_status_bar(text)
        assert len(line) < 120 and (line == text or line.endswith("(more in the sidebar)"))
        assert line.split(" (more")[0] in text
    assert len(errors.for_status_bar("word " * 60)) < 120


@pytest.mark.parametrize(
    "make", ["two_sheets", pytest.param("monkey", marks=pytest.mark.halved), "fold"]
)
def test_every_operator_reports_lines_below_120_characters(make, part, monkeypatch, capfd):
    """As a window has them: the whole is in the sidebar then."""
    monkeypatch.setattr(part("errors"), "_has_window", lambda: True)
    seen = 0
    for tool in part("ui.tools").all_tools():
        if bpy.context.mode != "OBJECT":
            bpy.ops.object.mode_set(mode="OBJECT")
        bpy.data.batch_remove(list(bpy.data.objects))
        bpy.context.view_layer.update()
        if make == "fold":
            ob = shapes.grid(6, uv=True)
            shapes.set_uv(ob, np.sin(9.0 * shapes.plane(ob)))
        else:
            {"two_sheets": lambda: shapes.two_sheets(squeezed=True), "monkey": shapes.monkey}[
                make
            ]()
        space, name = tool.operator.split(".")
        operator = getattr(getattr(bpy.ops, space), name)
        said = ""
        try:
            if operator.poll():
                operator()
        except RuntimeError as error:
            said = str(error)
        for line in (said + "\n" + capfd.readouterr().out).splitlines():
            kind, _, text = line.partition(": ")
            text = text if kind in ("Info", "Warning", "Error") else line
            seen += kind in ("Info", "Warning", "Error")
            assert len(text) < 120, (tool.operator, text)
    assert seen > 5
