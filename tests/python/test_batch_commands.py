"""python -m flipfree: every command on files of models, each solved in a process of its own."""

import json
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from commands import judged, mapped, refusal, run

import flipfree as ff
from flipfree.batch.models.model import welded

import surfaces

# A process of its own each.
pytestmark = [pytest.mark.sample(24), pytest.mark.usefixtures("here")]


def write(name, *meshes):
    """All meshes as parts of one file."""
    ff.write(name, surfaces.joined(*meshes))


def test_repair_gives_places_to_faces_that_have_none():
    vertices, faces = surfaces.torus()
    uv = ff.unwrap(vertices, faces, seams="given").uv.copy()
    uv[7] = uv[7, ::-1]
    ff.write("torn.obj", (vertices, faces, uv))
    lines = Path("torn.obj").read_text().splitlines()
    last = max(k for k, line in enumerate(lines) if line.startswith("f "))
    lines[last] = "f " + " ".join(corner.split("/")[0] for corner in lines[last].split()[1:])
    Path("torn.obj").write_text("\n".join(lines))
    record = run("improve", "torn.obj", "--out", "improved")
    assert record["status"] == "refused" and "no texture coordinates" in record["message"]
    mapped("repair", "torn.obj", "--out", "mended")
    judged("mended/torn.obj", bijective=True)


@pytest.mark.parametrize("name", ["torus.obj", "torus.ply", "torus.off", "torus.stl"])
def test_unwrap_maps_files_of_every_type(name):
    write(name, surfaces.torus())
    record = run("unwrap", name, "--out", "uv", "--suffix", ".obj")
    assert record["status"] == "certified" and record["written"]
    assert record["options"]["seams"] == "auto"
    assert record["certificate"]["flips32"] == 0 and 1.0 <= record["energy"] < 2.0
    mesh = judged("uv/torus.obj", bijective=True, disjoint=True)
    assert len(mesh.faces) == record["certificate"]["triangles"]
    checked = run("check", "uv/torus.obj")
    assert checked["status"] == "certified" and checked["output"] is None


@pytest.mark.parametrize(
    "words",
    [
        *(
            "unwrap --margin-pixels nan",
            "unwrap --margin-pixels -1",
            "unwrap --margin-pixels wide",
        ),
        *("unwrap --stretch 1", "unwrap --stretch inf", "unwrap --max-seconds 0"),
        *("unwrap --timeout nan", "unwrap --memory -1", "unwrap --threads 0", "unwrap --jobs 1.5"),
        *(
            "improve --iterations -1",
            "improve --iterations 3000000000",
            "repair --margin-pixels inf",
        ),
        *("pack --margin-pixels -1", "pack --margin-pixels nan", "pack --texture-size 0"),
        *("pack --tile 1000", "pack --tile 1101", "pack --tiles 0", "pack --tiles 101"),
        *("pack --effort -1", "pack --effort 1001", "pack --effort nan"),
        *("conformal --bound 1", "conformal --bound nan", "conformal --margin-pixels -1e-9"),
        *("field --curvature 1.1", "field --curvature nan", "field --sharp-from -1"),
        "field --sharp-from 181",
    ],
)
def test_numbers_that_suit_no_model_are_refused_before_any_is_read(words, capsys):
    name, option, value = words.split()
    said = refusal(capsys, name, "models", "--out", "uv", f"{option}={value}")
    assert f"argument {option}: must be a " in said and repr(value) in said


def test_a_gap_of_half_the_texture_is_refused_by_its_name_before_any_model_is_read(capsys):
    given = ["pack", "models", "--out", "uv", "--margin-pixels", "512"]
    half = "--margin-pixels 512: it must be below half of the 1024"
    assert half in refusal(capsys, *given)
    assert "no such file" in refusal(capsys, *given, "--texture-size", "2048")


@pytest.mark.parametrize(
    "name", ["unwrap", "match", "conformal", "seamless", "field", "improve", "repair", "pack"]
)
def test_in_and_out_may_lie_in_one_folder_whatever_they_are_called(name, capsys):
    source, target = "Würfel (alt) #1.obj", "Würfel neu ß.obj"
    vertices, faces = surfaces.bumpy_grid(5)
    ff.write(source, (vertices, faces, vertices[faces][:, :, :2]))
    Path(f"{source}.pins.json").write_text(json.dumps({"points": {"0": [0.25, 0.5]}}))
    record = mapped(name, source, target)
    assert (record["input"], record["output"]) == (source, target)
    judged(target)
    refusal(capsys, name, source, source)


def test_what_a_killed_run_left_half_written_goes():
    write("torus.obj", surfaces.torus())
    Path("uv").mkdir()
    Path("uv/.torus.obj.123.part").touch()
    Path("uv/.other.obj.123.part").touch()
    run("unwrap", "torus.obj", "--out", "uv")
    assert sorted(p.name for p in Path("uv").iterdir()) == [".other.obj.123.part", "torus.obj"]


@pytest.mark.parametrize("name", ["conformal", "seamless", "field"])
def test_surfaces_of_several_parts_open_and_closed_are_mapped(name):
    write("parts.obj", surfaces.torus(), surfaces.bumpy_grid(12), surfaces.octahedron_sphere(3))
    record = mapped(name, "parts.obj", "--out", "uv")
    mesh = judged("uv/parts.obj", seamless=name != "conformal", cones=None)
    assert mesh.uv.min() >= 0.0 and mesh.uv.max() <= 1.0
    if name != "conformal":
        assert record["certificate"]["seams_exact32"] == record["certificate"]["seam_edges"] > 0


def test_what_is_no_surface_is_separated_first():
    vertices, faces = surfaces.bumpy_grid(8)[:2]
    fin = np.array([[0, 1, len(vertices)], [1, 0, len(vertices)]])  # two more faces at an edge
    write("fin.obj", (np.vstack([vertices, [[0.5, -1.0, 2.0]]]), np.vstack([faces, fin])))
    for name in ("unwrap", "conformal"):
        record = mapped(name, "fin.obj", "--out", name)
        assert record["certificate"]["mends"]


def test_improve_and_pack_take_the_map_of_the_file():
    vertices, faces = surfaces.bumpy_grid(12)[:2]
    uv = vertices[faces][:, :, :2] * [1.0, 0.3]
    ff.write("flat.obj", (vertices, faces, uv))
    before = run("check", "flat.obj")["energy"]
    assert run("improve", "flat.obj", "--out", "better")["energy"] < before
    packed = mapped("pack", "better/flat.obj", "--out", "packed", "--margin-pixels", 4)
    assert 0 < packed["fill"] <= 1
    judged("packed/flat.obj", bijective=True, disjoint=True)
    write("bare.obj", surfaces.bumpy_grid(4))
    assert "no texture coordinates" in run("pack", "bare.obj", "--out", "packed")["message"]


def test_match_meets_the_pins_beside_the_model():
    vertices, faces = surfaces.bumpy_grid(8)[:2]
    write("sheet.obj", (vertices, faces))
    missing = run("match", "sheet.obj", "--out", "uv")
    assert missing["status"] == "refused" and "sheet.obj.pins.json" in missing["message"]
    hashes = set()
    for u in (0.0, 1.0):  # changed pins are changed input
        Path("sheet.obj.pins.json").write_text(json.dumps({"points": {"0": [u, 0.0]}}))
        hashes.add(run("match", "sheet.obj", "--out", "uv")["hash"])
    assert len(hashes) == 2
    pins = {"0": [0.25, 0.5], "7": [1.5, 0.125], "40": [0.75, 3.0]}
    Path("sheet.obj.pins.json").write_text(json.dumps({"points": pins}))
    record = mapped("match", "sheet.obj", "--out", "uv")
    assert record["certificate"]["pin_failures"] == 0
    mesh = judged("uv/sheet.obj")
    for vertex, place in pins.items():
        assert (mesh.uv[mesh.faces == int(vertex)] == place).all()


@pytest.mark.parametrize("name", ["seamless", "field"])
def test_seamless_maps_meet_the_pins_beside_the_model(name):
    write("ring.obj", surfaces.torus())
    run(name, "ring.obj", "free.obj")
    free = ff.read("free.obj")
    inside = next(v for v in range(len(free.vertices)) if v not in free.seams())
    place = free.uv[free.faces == inside][0] + 1e-3
    Path("ring.obj.pins.json").write_text(json.dumps({"points": {str(inside): place.tolist()}}))
    mapped(name, "ring.obj", "out.obj", "--meet-pins")
    mesh = judged("out.obj", seamless=True)
    assert (np.float32(mesh.uv[mesh.faces == inside]) == np.float32(place)).all()


def test_a_surface_takes_the_shape_of_another_through_their_maps():
    vertices, faces = surfaces.bumpy_grid(6, 6)
    ff.write("flat.obj", (vertices * [1, 1, 0], faces, vertices[faces][..., :2]))
    other, fine = surfaces.bumpy_grid(9, 9, height=0.4)
    ff.write("bent.obj", (other, fine, other[fine][..., :2]))
    run("transfer", "flat.obj", "out.obj", "--source", "bent.obj")
    out = ff.read("out.obj")
    assert np.allclose(out.vertices[:, :2], vertices[:, :2]) and np.ptp(out.vertices[:, 2]) > 0.1
    corners = [0, 6, 42, 48]
    assert np.allclose(out.vertices[corners], other[[0, 9, 90, 99]])
    ff.write("half.obj", (other, fine, other[fine][..., :2] / 2))
    record = run("transfer", "flat.obj", "no.obj", "--source", "half.obj")
    assert record["status"] == "refused" and "outside" in record["message"]
    assert not Path("no.obj").exists()


def test_cones_come_from_the_file_beside_the_model():
    write("ball.obj", surfaces.octahedron_sphere(3))
    Path("ball.obj.cones.json").write_text(json.dumps({str(v): 180 for v in range(4)}))
    record = mapped("seamless", "ball.obj", "--out", "uv")
    assert record["cones"] == 4
    Path("ball.obj.cones.json").write_text(json.dumps({"0": 100}))
    record = run("seamless", "ball.obj", "--out", "no")
    assert record["status"] == "refused" and "multiple of 90" in record["message"]


def test_quads_are_as_dense_as_the_file_beside_the_model_says():
    """Seven times as dense in one half of a sphere as in the other."""
    vertices, faces = surfaces.octahedron_sphere(4)
    write("ball.obj", (vertices, faces))
    right = {str(v): 7 for v in np.flatnonzero(vertices[:, 0] > 0).tolist()}
    Path("ball.obj.density.json").write_text(json.dumps(right))
    assert run("quads", "ball.obj", "--target", "800", "--out", "q")["status"] != "refused"
    made = ff.read(Path("q") / "ball.obj").vertices
    assert (made[:, 0] > 0.1).sum() > 3 * (made[:, 0] < -0.1).sum() > 0
    for wrong in ({"0": "much"}, {"0": -1}):
        Path("ball.obj.density.json").write_text(json.dumps(wrong))
        assert run("quads", "ball.obj", "--out", "no")["status"] == "refused"


def split(vertices, faces):
    """Every corner a vertex of its own, as formats with one normal a vertex have it at hard edges."""
    return vertices[faces].reshape(-1, 3), np.arange(3 * len(faces), dtype=np.int32).reshape(-1, 3)


def test_split_vertices_are_one_unless_they_are_to_stay_apart():
    write("split.obj", split(*surfaces.torus()[:2]))
    assert run("unwrap", "split.obj", "--out", "uv")["islands"] < 10
    judged("uv/split.obj", bijective=True)
    apart = run("unwrap", "split.obj", "--out", "apart", "--no-merge")
    assert apart["islands"] == len(surfaces.torus()[1])


@pytest.mark.parametrize(
    ("corners", "left"),
    [
        (((0, 1, 2), (1, 0, 3)), 4),
        (((0, 1, 2), (1, 0, 3), (1, 0, 4)), 9),  # three at an edge
        (((0, 1, 2), (0, 1, 3)), 6),  # turned over
    ],
)
def test_welding_joins_two_faces_that_look_to_one_side(corners, left):
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1]], float)
    torn, own = split(points, np.array(corners))
    assert len(np.unique(welded(torn, own)[own])) == left


def test_welding_never_makes_two_corners_of_a_face_one():
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 0, 0], [0, 0, 0], [1, 0, 0], [0, 1, 0]], float)
    folded = np.array([[0, 1, 2], [3, 4, 5]], np.int32)  # the first face's sides lie on each other
    same = welded(points, folded)
    assert all(len(set(face)) == 3 for face in same[folded].tolist())


def test_a_poor_map_is_a_warning_in_the_words_of_the_command_line():
    vertices, faces = surfaces.bumpy_grid(8)[:2]
    ff.write("thin.obj", (vertices, faces, vertices[faces][:, :, :2] * [1.0, 0.01]))
    record = run("check", "thin.obj")
    assert record["status"] == "warned"
    assert "100 % of the surface is stretched beyond 1.25" in record["message"]
    assert record["certificate"]["stretched"] == 1.0 and record["certificate"]["poor"]


def test_a_map_with_flips_is_refused_by_check():
    vertices, faces = surfaces.bumpy_grid(8)[:2]
    points = vertices[:, :2].copy()
    points[len(points) // 2] += 3.0 * np.ptp(points)
    ff.write("folded.obj", (vertices, faces, points[faces]))
    record = run("check", "folded.obj")
    assert record["status"] == "refused" and record["reason"] == "certificate failed"
    assert record["certificate"]["flips32"] > 0 and not record["certificate"]["ok"]


def test_mirrored_islands_are_told_by_check():
    vertices, faces = surfaces.bumpy_grid(8)[:2]
    ff.write("turned.obj", (vertices, faces, vertices[faces][:, :, :2] * [-1.0, 1.0]))
    found = run("check", "turned.obj")["certificate"]
    assert found["mirrored_islands"] == 1 and found["flips32"] == 0 and found["ok"]


def test_a_limit_of_time_is_that_of_the_model_and_errors_name_it():
    """Calls of one model share it: many parts, and what follows them, do not get it once each."""
    spheres = [surfaces.octahedron_sphere(5) for _ in range(12)]
    write("many.obj", *spheres)
    for name in ("conformal", "seamless"):
        limit = 0.8
        begin = time.monotonic()
        record = run(name, "many.obj", "--out", "uv", "--max-seconds", limit)
        assert time.monotonic() - begin < 20
        if record["status"] == "failed":
            assert record["reason"] == "time limit reached"
            assert f"(--max-seconds {limit})" in record["message"]
        else:
            assert record["status"] in ("certified", "warned")


def test_unknown_commands_and_options_say_so(capsys):
    words = [sys.executable, "-m", "flipfree", "fold", "x"]
    process = subprocess.run(words, capture_output=True, text=True, timeout=300)
    assert process.returncode == 2 and "invalid choice" in process.stderr
    assert "no such file" in refusal(capsys, "unwrap", "x", "--out", "y")
    write("torus.obj", surfaces.torus())
    assert "Name one" in refusal(capsys, "unwrap", "torus.obj", "--out", "uv", "--json", "-")


def test_maps_keep_their_shape_on_textures_that_are_no_squares():
    write("sheet.obj", surfaces.bumpy_grid(6, 6))
    square = run("unwrap", "sheet.obj", "--out", "square")
    shapes = {"unwrap": "2", "improve": "16:8", "repair": "1024x512", "pack": "2", "check": "2:1"}
    for name, shape in shapes.items():
        source = "sheet.obj" if name == "unwrap" else "unwrap/sheet.obj"
        out = [] if name == "check" else ["--out", name]
        record = run(name, source, *out, "--aspect", shape)
        assert record["status"] == "certified"
        assert record["energy"] == pytest.approx(square["energy"], rel=0.01), name
        if out:
            mesh = judged(f"{name}/sheet.obj")
            seen = ff.certify(mesh.vertices, mesh.faces, mesh.uv, aspect=2.0)
            assert seen.energy == pytest.approx(square["energy"], rel=0.01)
    assert run("check", "unwrap/sheet.obj")["energy"] > square["energy"] * 1.02


def test_the_shape_of_a_texture_is_asked_for_in_words_that_it_understands(capsys):
    write("sheet.obj", surfaces.bumpy_grid(3, 3))
    given = ("sheet.obj", "--out", "out", "--aspect")
    for shape in ("0", "wide", "1:0", "40", "nan"):
        assert "16:9" in refusal(capsys, "unwrap", *given, shape)
    assert "--tiles" in refusal(capsys, "pack", *given, "2", "--tiles", "2")
