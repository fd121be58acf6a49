"""What a batch will do is known, and refused if it cannot be done, before anything is solved."""

import itertools
import os
import re
from pathlib import Path

import pytest

from flipfree.batch.plan import Formats, Item, PlanError, one_file, plan, shard

FORMATS = Formats(reads=(".obj", ".stl"), writes=(".obj", ".ply"))


@pytest.fixture
def models(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name in (
        "m/a.obj",
        "m/b/a.obj",
        "m/b/c.OBJ",
        "m/b/readme.txt",
        "m/.hidden/d.obj",
        "m/.e.obj",
    ):
        path = Path(name)
        path.parent.mkdir(parents=True, exist_ok=True)
        path.touch()
    return Path("m")


def outputs(*inputs, out="uv", **options):
    options = {"suffix": None, **options}
    items = plan(
        list(map(str, inputs)), out=out and Path(out), formats=FORMATS, writes=True, **options
    )
    return {item.source.as_posix(): item.target.as_posix() for item in items}


def test_folders_keep_their_structure_and_hidden_files_are_passed_over(models):
    assert outputs("m") == {
        "m/a.obj": "uv/a.obj",
        "m/b/a.obj": "uv/b/a.obj",
        "m/b/c.OBJ": "uv/b/c.OBJ",
    }


def test_patterns_keep_what_lies_below_their_first_wildcard(models):
    assert outputs("m/**/a.obj") == {"m/a.obj": "uv/a.obj", "m/b/a.obj": "uv/b/a.obj"}
    assert outputs("m/b/*") == {"m/b/a.obj": "uv/a.obj", "m/b/c.OBJ": "uv/c.OBJ"}
    assert outputs("m/b/[ac].*") == outputs("m/b/*")


def test_single_files_keep_their_name_only(models):
    assert outputs("m/b/a.obj", suffix=".ply") == {"m/b/a.obj": "uv/a.ply"}


def test_a_file_given_twice_is_one_item(models):
    assert outputs("m", "m/a.obj", os.path.abspath("m/a.obj")) == outputs("m")


def test_outputs_inside_the_inputs_folder_are_no_inputs_of_the_next_run(models):
    Path("m/uv").mkdir()
    Path("m/uv/a.obj").touch()
    assert outputs("m", out="m/uv") == {
        "m/a.obj": "m/uv/a.obj",
        "m/b/a.obj": "m/uv/b/a.obj",
        "m/b/c.OBJ": "m/uv/b/c.OBJ",
    }


@pytest.mark.parametrize(
    ("inputs", "options", "words"),
    [
        (["m/a.obj", "m/b/a.obj"], {}, "same output, uv/a.obj"),
        (["m/a.obj"], {"out": "m"}, "overwrite the input itself"),
        (["m/a.obj"], {"out": None, "suffix": ".obj"}, "overwrite the input itself"),
        (["m/b/a.obj"], {"out": "m"}, None),
        (["m"], {"out": None}, "where the maps go"),
        (["m"], {"suffix": ".stl"}, "cannot be written to files of this type"),
        (["m/b/a.obj", "m/a.obj"], {"out": "m"}, "overwrite the input m/a.obj"),
        (["m/a.obj", "m/b/a.obj"], {"suffix": ".ply"}, "Give the folder that holds both"),
        (["nowhere"], {}, "no such file or folder"),
        (["m/*.ply"], {}, "no models are there"),
        (["m/b/readme.txt"], {}, "cannot be read"),
    ],
)
def test_what_cannot_be_done_is_refused_with_the_cure(models, inputs, options, words):
    if words is None:
        assert outputs(*inputs, **options) == {"m/b/a.obj": "m/a.obj"}
        return
    with pytest.raises(PlanError, match=words):
        outputs(*inputs, **options)


def test_inputs_without_room_for_uvs_need_another_suffix(models):
    Path("m/part.stl").touch()
    with pytest.raises(PlanError, match="hold no texture coordinates. Add --suffix"):
        outputs("m/part.stl")
    assert outputs("m/part.stl", suffix=".ply") == {"m/part.stl": "uv/part.ply"}
    Path("m/part.obj").touch()
    with pytest.raises(
        PlanError, match=r"part.obj and m/part.stl have the same output, uv/part.obj"
    ):
        outputs("m/part.obj", "m/part.stl", suffix=".obj")


@pytest.mark.parametrize(
    "given", [["m"], ["m/*", "m/b/c.OBJ"], ["m/a.obj", "m/b/c.OBJ", "m/part.stl"]]
)
def test_a_file_of_another_type_costs_no_other_one(models, given):
    Path("m/part.stl").touch()
    items = {
        item.source.as_posix(): item
        for item in plan(given, out=Path("uv"), suffix=None, formats=FORMATS, writes=True)
    }
    other = items.pop("m/part.stl")
    assert other.target is None and "Add --suffix with one of .obj, .ply" in other.refusal
    assert items.keys() >= {"m/a.obj", "m/b/c.OBJ"}
    assert all(item.target and not item.refusal for item in items.values())


def test_a_file_that_cannot_be_read_costs_no_other_one_that_is_named(models):
    named = plan(
        ["m/a.obj", "m/b/readme.txt"], out=None, suffix=None, formats=FORMATS, writes=False
    )
    assert [bool(item.refusal) for item in named] == [False, True]
    assert ".txt files cannot be read" in named[1].refusal


def test_inputs_that_differ_in_their_ending_alone_can_be_told_apart_as_the_error_says(models):
    for name in ("m/part.obj", "m/part.stl"):
        Path(name).touch()
    parts = ("m/part.obj", "m/part.stl")
    for suffix, name in ((".obj", r"part\.stl\.obj"), (".ply", r"part\.stl\.ply")):
        with pytest.raises(PlanError, match=f"Add --keep-endings.*: {name}"):
            outputs(*parts, suffix=suffix)
    assert outputs(*parts, suffix=".obj", keep_endings=True) == {
        "m/part.obj": "uv/part.obj",
        "m/part.stl": "uv/part.stl.obj",
    }
    assert outputs(*parts, suffix=".ply", keep_endings=True) == {
        "m/part.obj": "uv/part.obj.ply",
        "m/part.stl": "uv/part.stl.ply",
    }
    assert len(outputs("m", suffix=".ply", keep_endings=True)) == 5
    Path("m/part.stl.obj").touch()
    with pytest.raises(PlanError, match="Rename one of them"):
        outputs("m", suffix=".obj", keep_endings=True)


def test_inputs_of_one_name_in_two_folders_are_told_apart_by_the_folder_that_holds_both(models):
    assert outputs("m", suffix=".ply")["m/b/a.obj"] == "uv/b/a.ply"


def test_nothing_is_written_where_a_command_has_no_outputs(models):
    Path("m/part.stl").touch()
    items = plan(["m"], out=None, suffix=None, formats=FORMATS, writes=False)
    assert len(items) == 4 and all(item.target is None for item in items)


@pytest.mark.parametrize(("count", "shares"), list(itertools.product([0, 1, 7, 100], [1, 2, 3, 8])))
def test_shards_hold_every_item_exactly_once(count, shares):
    items = [Item(Path(f"{i}.obj"), None) for i in range(count)]
    parts = [shard(items, f"{i}/{shares}") for i in range(1, shares + 1)]
    assert sorted(sum(parts, []), key=items.index) == items
    assert max(map(len, parts)) - min(map(len, parts)) <= 1


@pytest.mark.parametrize("share", ["0/4", "5/4", "1", "a/b", "1/0", "-1/4"])
def test_shards_that_are_none_are_refused(share):
    with pytest.raises(PlanError, match="--shard"):
        shard([], share)


@pytest.mark.parametrize("folder", ["m", "new/folder", "."])
@pytest.mark.parametrize("name", ["other.obj", "other.ply", "größer als zuvor.OBJ"])
def test_one_file_has_an_output_of_its_own_name_in_any_folder(models, folder, name):
    source, target = Path("m/a.obj"), Path(folder, name)
    assert one_file(source, target, FORMATS) == Item(source, target)


def test_the_output_of_one_file_is_not_overwritten_but_by_its_own_run(models):
    with pytest.raises(PlanError, match="there already"):
        one_file(Path("m/a.obj"), Path("m/b/a.obj"), FORMATS)
    assert one_file(Path("m/a.obj"), Path("m/b/a.obj"), FORMATS, again=True).target
    for target in ("m/a.obj", "m/b/../a.obj", "m"):
        with pytest.raises(PlanError, match="there already"):
            one_file(Path("m/a.obj"), Path(target), FORMATS, again=True)


@pytest.mark.parametrize(
    ("source", "target", "words"),
    [
        ("m/a.obj", "new/other.stl", ".stl files hold no texture coordinates. Use .obj, .ply"),
        ("m/a.obj", "new/other", "files without an ending hold no texture coordinates"),
        ("m/b/readme.txt", "new/other.obj", ".txt files cannot be read"),
        ("m/nowhere.obj", "new/other.obj", "no such file"),
        ("m", "new", "--out FOLDER"),
        ("m", "new.obj", "--out FOLDER"),
        ("m/*.obj", "new.obj", "--out FOLDER"),
    ],
)
def test_one_file_that_cannot_be_mapped_is_refused_with_the_cure(models, source, target, words):
    with pytest.raises(PlanError, match=re.escape(words)):
        one_file(Path(source), Path(target), FORMATS)


def test_a_name_with_a_wildcard_in_it_is_one_file_if_it_is_there(models):
    Path("m/a[1].obj").touch()
    assert one_file(Path("m/a[1].obj"), Path("m/b.obj"), FORMATS).target == Path("m/b.obj")
