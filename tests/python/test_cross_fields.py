"""Cross fields by their cones and turns, which a judge adds up in 80-bit numbers; files; arguments."""

from __future__ import annotations

import gzip
import pickle
from pathlib import Path

import numpy as np
import pytest

import flipfree as ff
from flipfree.calls.seamless import halfedges_of_strip

from judges import fields, holonomy
from mesh_files import read_mesh, shared
from surfaces import bumpy_grid, cylinder, joined, octahedron_sphere, torus

SPECK = torus()[0] * 1e-93, torus()[1]  # beside others: squares of its areas are no numbers
CLOSED = {"sphere": octahedron_sphere(3), "torus": torus()}
JUDGED = {**CLOSED, "sphere and speck": joined(CLOSED["sphere"], SPECK)}


def cones_of(signature: ff.Signature, count: int) -> np.ndarray:
    cones = np.full(count, 4)
    cones[list(signature.cones)] = list(signature.cones.values())
    return cones


def strips(signature: ff.Signature, faces: np.ndarray) -> list[list[int]]:
    return [halfedges_of_strip(faces, strip, "strip").tolist() for strip, _ in signature.loops]


def test_the_fields_of_the_shared_data_have_the_cones_that_lie_beside_them() -> None:
    models = sorted(shared("fields").glob("*_Th_hat"))
    assert len(models) == 10
    for path in models:
        name = str(path).removesuffix("_Th_hat")
        mesh = read_mesh(Path(name + ".obj"))
        field = ff.CrossField.read(name + "_kappa_hat.gz", mesh.vertices, mesh.faces)
        signature = ff.signature(mesh.vertices, mesh.faces, field)
        given = np.rint(np.loadtxt(path) / (np.pi / 2)).astype(int)
        assert (cones_of(signature, len(given)) == given).all(), name
        with gzip.open(name + "_kappa_hat.gz") as file:
            rotation = np.loadtxt(file)
        judged = fields.judge(mesh.vertices, mesh.faces, rotation, strips(signature, mesh.faces))
        assert (judged.cones == given).all(), name
        assert judged.turns == [turns for _, turns in signature.loops], name
        assert judged.error < 1e-9, name


@pytest.mark.parametrize("name", ["bumpy", "eight"])
def test_raw_fields_of_the_shared_data_have_the_singularities_that_lie_beside_them(
    name: str,
) -> None:
    mesh = read_mesh(shared(f"fields/{name}.off"))
    field = ff.CrossField.read(shared(f"fields/{name}.rawfield"), mesh.vertices, mesh.faces)
    signature = ff.signature(mesh.vertices, mesh.faces, field)
    lines = shared(f"fields/{name}.sings").read_text().splitlines()[1:]
    given = {int(v): 4 - int(index) for v, index in (line.split() for line in lines if line)}
    assert signature.cones == given


@pytest.mark.parametrize("name", JUDGED)
@pytest.mark.parametrize("alignment", [0.0, 0.6])
def test_the_judge_finds_the_same_cones_and_turns(name: str, alignment: float) -> None:
    vertices, faces = JUDGED[name]
    field = ff.cross_field(vertices, faces, alignment=alignment)
    signature = ff.signature(vertices, faces, field)
    assert len(signature.loops) == (0 if name == "sphere" else 2)
    judged = fields.judge(vertices, faces, field.rotation, strips(signature, faces))
    assert (judged.cones == cones_of(signature, len(vertices))).all()
    assert judged.turns == [turns for _, turns in signature.loops]
    assert judged.error < 1e-9
    assert sum(4 - k for k in signature.cones.values()) == (0 if name == "torus" else 8)


def test_any_basis_turns_as_the_judge_says() -> None:
    vertices, faces = torus()
    field = ff.CrossField(np.random.default_rng(3).normal(size=faces.shape))
    signature = ff.signature(vertices, faces, field)
    rotation = fields.nearest_rotation(vertices, faces, field.directions)
    judged = fields.judge(vertices, faces, rotation, strips(signature, faces))
    assert (judged.cones == cones_of(signature, len(vertices))).all()
    assert judged.turns == [turns for _, turns in signature.loops]


@pytest.mark.parametrize("seed", range(5))
def test_a_signature_is_met_exactly(seed: int) -> None:
    vertices, faces = torus()
    random = np.random.default_rng(seed)
    places = random.permutation(len(vertices))[:8]
    cones = {int(v): 3 if i % 2 else 5 for i, v in enumerate(places)}
    loops = [
        ([h // 3 for h in loop], int(random.integers(-3, 4)))
        for loop in holonomy.random_homology_basis(faces, seed)
    ]
    field = ff.cross_field(vertices, faces, signature=ff.Signature(cones, loops))
    judged = fields.judge(
        vertices,
        faces,
        field.rotation,
        [halfedges_of_strip(faces, np.array(strip), "strip").tolist() for strip, _ in loops],
    )
    assert {int(v): int(k) for v, k in enumerate(judged.cones) if k != 4} == cones
    assert judged.turns == [turns for _, turns in loops]
    assert judged.error < 1e-9
    assert ff.signature(vertices, faces, field).cones == cones


def test_a_field_with_cones_alone_turns_little() -> None:
    vertices, faces = torus()
    field = ff.cross_field(vertices, faces, signature=ff.Signature({}, []))
    assert ff.signature(vertices, faces, field).cones == {}
    assert np.abs(field.rotation).max() < np.pi / 4


def test_a_field_follows_sharp_edges_and_the_boundary_exactly() -> None:
    vertices, faces = bumpy_grid(12, 10)
    edge = (5 * 13 + 4, 5 * 13 + 5)
    field = ff.cross_field(vertices, faces, sharp_edges=[edge])
    along = vertices[edge[1]] - vertices[edge[0]]
    beside = [f for f, face in enumerate(faces) if set(edge) <= set(face.tolist())]
    assert len(beside) == 2
    for f in beside:
        c = abs(field.directions[f] @ along) / np.linalg.norm(along)
        assert min(c, 1 - c) < 1e-9
    free = ff.cross_field(vertices, faces, boundary=False)
    assert not np.allclose(free.rotation, field.rotation)


def test_a_field_on_a_cylinder_follows_its_curvature() -> None:
    vertices, faces = cylinder()
    field = ff.cross_field(vertices, faces, alignment=0.9, boundary=False)
    axis = np.abs(field.directions @ [0.0, 0.0, 1.0])
    assert np.minimum(axis, 1 - axis).max() < 0.05


def test_a_field_for_a_map_of_varying_size_turns_as_that_map_does() -> None:
    # A square scaled by e^x is flat: z to e^z maps it, and takes to +u what turns by -y.
    vertices, faces = bumpy_grid(20, 15, height=0.0)
    field = ff.cross_field(vertices, faces, boundary=False, sizing=np.exp(vertices[:, 0]))
    assert field.stats is not None and field.stats["cones"] == 0
    y = vertices[faces][:, :, 1].mean(axis=1)
    cross = np.exp(4j * (np.arctan2(field.directions[:, 1], field.directions[:, 0]) + y))
    assert abs(np.angle(cross / cross.mean())).max() < 4 * 0.02
    plain = ff.cross_field(vertices, faces, boundary=False)
    same = ff.cross_field(vertices, faces, boundary=False, sizing=np.full(len(vertices), 3.0))
    assert (plain.directions == same.directions).all()


def test_simplifying_says_what_it_did() -> None:
    vertices, faces = octahedron_sphere(4)
    vertices = vertices * (1 + 0.2 * np.sin(9 * vertices[:, :1]) * np.cos(8 * vertices[:, 1:2]))
    plain = ff.cross_field(vertices, faces, alignment=0.9)
    simple = ff.cross_field(vertices, faces, alignment=0.9, simplify=True)
    assert plain.stats is not None and simple.stats is not None
    assert simple.stats["cancelled"] > 0
    assert simple.stats["cones"] < plain.stats["cones"]
    assert simple.stats["sharp_cones"] == 0
    assert min(ff.signature(vertices, faces, simple).cones.values()) >= 2


@pytest.mark.parametrize("kind", ["rawfield", "ffield", "txt", "kappa.gz"])
@pytest.mark.parametrize("name", CLOSED)
def test_fields_come_back_from_files(tmp_path: Path, kind: str, name: str) -> None:
    vertices, faces = CLOSED[name]
    field = ff.cross_field(vertices, faces, alignment=0.2)
    path = tmp_path / f"field.{kind}"
    field.write(path, vertices, faces)
    again = ff.CrossField.read(path, vertices, faces)
    before, after = (ff.signature(vertices, faces, f) for f in (field, again))
    assert before.cones == after.cones
    assert [t for _, t in before.loops] == [t for _, t in after.loops]
    assert field.rotation is not None and again.rotation is not None
    assert np.abs(again.rotation - field.rotation).max() < 1e-9
    if kind in ("rawfield", "ffield"):
        assert np.abs(np.abs((again.directions * field.directions).sum(1)) - 1).max() < 1e-9


def test_files_that_are_no_fields_are_refused_by_name(tmp_path: Path) -> None:
    vertices, faces = torus()
    texts = {
        "a.rawfield": "4 3\n0 0 0", "b.rawfield": "2 1\n", "c.rawfield": "4 x", "d.ffield": "# 1\n",
        "e.ffield": "crossfield_angles\n1 2 3\n", "f.txt": "1 2 nan", "g.txt": "0.5", "h.gz": "not gzip",
    }  # fmt: skip
    for name, text in texts.items():
        (tmp_path / name).write_text(text)
        with pytest.raises(ff.InvalidInput, match=name):
            ff.CrossField.read(tmp_path / name, vertices, faces)
    with pytest.raises(ff.InvalidInput, match="cannot be read"):
        ff.CrossField.read(tmp_path / "none.rawfield", vertices, faces)
    with pytest.raises(ff.InvalidInput, match="cannot be written"):
        ff.cross_field(vertices, faces).write(tmp_path / "no" / "x.rawfield", vertices, faces)


def test_rotations_that_are_no_field_are_refused() -> None:
    vertices, faces = torus()
    rotation = ff.cross_field(vertices, faces).rotation
    assert rotation is not None
    wrong = rotation.copy()
    wrong[5, 1] += 0.1
    with pytest.raises(ff.InvalidInput, match="edge 1 of face 5|opposite"):
        ff.CrossField.from_rotation(vertices, faces, wrong)
    opposite = int(holonomy.opposite_halfedges(faces)[16])
    wrong[divmod(opposite, 3)] -= 0.1
    with pytest.raises(ff.InvalidInput, match="not that of a cross field"):
        ff.CrossField.from_rotation(vertices, faces, wrong)
    with pytest.raises(ff.InvalidInput, match="rotation must have shape"):
        ff.CrossField.from_rotation(vertices, faces, rotation[:3])
    again = ff.CrossField.from_rotation(vertices, faces, rotation)
    assert again.rotation is not None
    assert np.abs(again.rotation - rotation).max() < 1e-9


def test_impossible_signatures_are_refused_with_a_reason() -> None:
    vertices, faces = torus()
    with pytest.raises(ff.Infeasible, match="Add 1 to"):
        ff.cross_field(vertices, faces, signature=ff.Signature({3: 3}, []))
    with pytest.raises(ff.InvalidInput, match="homology"):
        around = [h // 3 for h in fields.around_vertex(faces, 5)]
        ff.cross_field(vertices, faces, signature=ff.Signature({}, [(around, 4), (around, 4)]))
    with pytest.raises(ff.InvalidInput, match="turning back"):
        ff.cross_field(vertices, faces, signature=ff.Signature({}, [([0, 1], 2)]))
    with pytest.raises(ff.InvalidInput, match="shares no edge"):
        ff.cross_field(vertices, faces, signature=ff.Signature({}, [([0, 77, 300], 2)]))


def test_a_field_is_of_its_mesh() -> None:
    vertices, faces = torus()
    field = ff.cross_field(vertices, faces)
    with pytest.raises(ff.InvalidInput, match="directions, but the mesh has"):
        ff.signature(*octahedron_sphere(2), field)
    across = field.directions.copy()
    corners = vertices[faces[[2, 3]]]
    across[[2, 3]] = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    with pytest.raises(ff.InvalidInput, match="no direction in the plane") as caught:
        ff.signature(vertices, faces, ff.CrossField(across))
    assert caught.value.elements == [2, 3]
    with pytest.raises(ff.InvalidInput, match="must be a CrossField"):
        ff.signature(vertices, faces, field.directions)  # type: ignore[arg-type]
    with pytest.raises(ff.InvalidInput, match="matching has 2 rows"):
        ff.CrossField(field.directions, np.zeros((2, 3), int))  # type: ignore[arg-type]
    copied = pickle.loads(pickle.dumps(field))
    assert ff.signature(vertices, faces, copied).cones == ff.signature(vertices, faces, field).cones
    with pytest.raises(ValueError, match="read-only"):
        copied.directions[0, 0] = 1.0
