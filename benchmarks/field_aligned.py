"""Field-aligned seamless maps of the shared data folder's closed models, with given fields and with our own.

    PYTHONPATH=build/python:tests python3 benchmarks/field_aligned.py [--only TEXT] [--own] [--random N] [--reach 1] [--halves]
                                                                     [--open aligned] [--engine padding] [--cuts] [--seconds 120] [--markdown]

Cases: fields/ with its fields, the two cones on a torus that no map has (torus_twosings) among them; `--open aligned` or `free`: the
models of general/ with a boundary, which the field follows if it is aligned (`G6` is then the certificate's own); `--own`: the closed
models of general/ and embedding/, and those of fields/, with the smoothest field, near cones merged with `--simplify`. `--random N`: N signatures on each of six surfaces of
genus 1 to 6: cones of 2 to 8 quarter turns (of 2 and 6 with `--halves`) at random vertices, and loops that turn by up to `--reach`
quarters more or less, at random, than needs the least rotation.
`G6` is the second judge's: on a homology basis that nobody has seen, does the map turn as the field does (judges/)? Angles are between
isolines and field, degrees, by area; `engine` before the alignment. CPU seconds are those of all threads.
`--cuts`: no maps, but the cuts of the engine "padding" for all cases of genus 1 and more: how many of the loops of a homology basis
turned otherwise than the field, by how many quarter turns together, and how many branches took the shortest detour (guided) or went
around cones one by one (fallback), as in thesis table 6.1; `as it is`: vertices that the cut adds whose loops turn as they happen to
(thesis 5), `length`: of the cut over that one's. A cut whose loops would not turn as the field does is an error; what the cuts are like
else, tests judge.
The exit status is 1 if a case is neither certified nor refused as Infeasible, or if the judge disagrees.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Iterator
from itertools import chain
from pathlib import Path

import numpy as np
import numpy.typing as npt

import flipfree as ff
from flipfree import _native
from flipfree.arrays import as_indices, as_vertices
from flipfree.fields.cross_fields import arrays_of

from judges import fields, holonomy
from judges.unfoldings import Unfolding, unfolding
from mesh_files import data_folder, read_mesh

COLUMNS = "case | F | cones | certified | G6 | engine angle | mean angle | 95 % | energy | added V | engine s | CPU s"

CUT_COLUMNS = "case | genus | F | cones | loops | quarters off | rerouted | guided | fallback | added V | as it is | length | CPU s"

RANDOM_MODELS = (
    "fields/rocker-arm2500.obj",
    "fields/eight766.obj",
    "fields/holes3_libigl.obj",
    "fields/fertility_input.obj",
    "conformal/gtorus006.obj",
)

NO_SURFACES = ("nonmanifold_toy", "zeroarea_48")

Mesh = tuple[str, npt.NDArray[np.float64], npt.NDArray[np.int32]]


def given(folder: Path) -> Iterator[tuple[Mesh, ff.CrossField]]:
    for path in sorted((folder / "fields").glob("*_kappa_hat.gz")):
        name = path.name.removesuffix("_kappa_hat.gz")
        mesh = read_mesh(path.with_name(name + ".obj"))
        field = ff.CrossField.read(path, mesh.vertices, mesh.faces)
        yield (name, mesh.vertices, mesh.faces), field


def given_raw(folder: Path) -> Iterator[tuple[Mesh, ff.CrossField]]:
    """Fields without a matching; that of the torus with cones 3 and 5 has no map."""
    for path in sorted((folder / "fields").glob("*.rawfield")):
        own = path.with_suffix(".off")
        mesh = read_mesh(own if own.exists() else path.with_name("torus.obj"))
        field = ff.CrossField.read(path, mesh.vertices, mesh.faces)
        yield (path.name, mesh.vertices, mesh.faces), field


def closed(folder: Path) -> Iterator[Mesh]:
    paths = [
        *folder.glob("fields/*.obj"),
        *folder.glob("general/*.o??"),
        *folder.glob("embedding/*.obj"),
    ]
    for path in sorted(paths):
        mesh = read_mesh(path)
        if (holonomy.opposite_halfedges(mesh.faces) >= 0).all():
            yield path.stem, mesh.vertices, mesh.faces


def perforated_plate(holes: int) -> Unfolding:
    """Cubes, three rows of them, with square holes in the middle one."""
    cells = [(x, y, 0) for x in range(2 * holes + 1) for y in range(3) if y != 1 or x % 2 == 0]
    return unfolding(cells, 4, 0)


def genus_of(mesh: Mesh) -> int:
    """Of a closed connected one; of several components less one each."""
    _, vertices, faces = mesh
    return 1 - (len(vertices) - len(faces) // 2) // 2


def has_boundary(faces: npt.NDArray[np.int32]) -> bool:
    return bool((holonomy.opposite_halfedges(faces) < 0).any())


def opened(folder: Path) -> Iterator[Mesh]:
    for path in sorted(folder.glob("general/*.o??")):
        mesh = read_mesh(path)
        if has_boundary(mesh.faces) and path.stem not in NO_SURFACES:
            yield path.stem, mesh.vertices, mesh.faces


def random_signature(
    mesh: Mesh, random: np.random.Generator, reach: int, halves: bool
) -> ff.Signature:
    _, vertices, faces = mesh
    euler = len(vertices) - len(faces) // 2
    choice = [2, 6] if halves else [2, 3, 3, 3, 5, 5, 5, 6, 8]
    quarters = [int(k) for k in random.choice(choice, int(random.integers(2, 13)))]
    missing = 4 * euler - sum(4 - k for k in quarters)
    step = 2 if halves else 1
    quarters += [4 - step if missing > 0 else 4 + step] * (abs(missing) // step)
    places = random.permutation(len(vertices))
    cones = {int(v): k for v, k in zip(places, quarters, strict=False)}
    near = ff.cross_field(vertices, faces, signature=ff.Signature(cones, []))
    loops = [
        (strip, turns + int(random.integers(-reach, reach + 1)))
        for strip, turns in ff.signature(vertices, faces, near).loops
    ]
    return ff.Signature(cones, loops)


def at_random(
    folder: Path, count: int, reach: int, halves: bool, only: str
) -> Iterator[tuple[Mesh, ff.CrossField]]:
    meshes = [(Path(name).stem, read_mesh(folder / name)) for name in RANDOM_MODELS]
    for name, mesh in [*meshes, ("plate of genus 5", perforated_plate(5))]:
        for seed in range(count):
            case = (f"{name} #{seed}", mesh.vertices, mesh.faces)
            if only not in case[0]:
                continue
            signature = random_signature(case, np.random.default_rng(seed), reach, halves)
            yield case, ff.cross_field(mesh.vertices, mesh.faces, signature=signature)


def agrees(mesh: Mesh, field: ff.CrossField, map: ff.Parametrization) -> bool:
    _, vertices, faces = mesh
    basis = holonomy.random_homology_basis(map.faces, 1)
    strips = [fields.projected(faces, map.faces, map.parent_face, loop) for loop in basis]
    wanted = fields.judge(vertices, faces, field.rotation, strips)
    cones = {int(v): int(k) for v, k in enumerate(wanted.cones) if k != 4}
    judged = holonomy.judge(map.faces, map.uv64, cones, basis)
    exact = judged.vertex_error < 1e-6 and judged.loop_error < 1e-6
    return exact and judged.turns == wanted.turns


def drawn_cut(mesh: Mesh, field: ff.CrossField, reroute: bool) -> tuple[dict[str, int], float]:
    """What was done to padding's cut, and how long it is."""
    _, vertices, faces = mesh
    face_array = as_indices(faces, "faces", 3)
    positions = as_vertices(vertices, face_array).scaled
    arrays = arrays_of(field, face_array)
    stats, lines = _native.field_cut(positions, face_array, *arrays, reroute, 1).result()
    return stats, sum(np.linalg.norm(np.diff(line, axis=0), axis=1).sum() for line in lines)


def cut_row(mesh: Mesh, field: ff.CrossField) -> tuple[str, bool]:
    name, vertices, faces = mesh
    start = time.process_time()
    try:
        s, length = drawn_cut(mesh, field, True)
    except ff.FlipfreeError as error:
        refused = isinstance(error, ff.Infeasible)
        return f"| {name} | {genus_of(mesh)} | {len(faces)} | {error.code}: {error} |", refused
    cpu = time.process_time() - start
    bare, bare_length = drawn_cut(mesh, field, False)
    count = len(ff.signature(vertices, faces, field).cones)
    rerouted = s["guided"] + s["fallback"]
    return (
        f"| {name} | {genus_of(mesh)} | {len(faces)} | {count} | {s['loops']} | {s['quarters']} | {rerouted} | "
        f"{s['guided']} | {s['fallback']} | {s['added_vertices']} | {bare['added_vertices']} | "
        f"{length / bare_length:.2f} | {cpu:.2f} |",
        True,
    )


def row(
    mesh: Mesh, field: ff.CrossField, boundary: str, engine: str, seconds: float
) -> tuple[str, bool]:
    name, vertices, faces = mesh
    count = len(ff.signature(vertices, faces, field).cones)
    start = time.process_time()
    try:
        map = ff.field_aligned(
            vertices, faces, field=field, boundary=boundary, engine=engine, max_seconds=seconds
        )
    except ff.FlipfreeError as error:
        refused = isinstance(error, ff.Infeasible)
        return f"| {name} | {len(faces)} | {count} | {error.code}: {error} |", refused
    cpu = time.process_time() - start
    s, c = map.stats, map.certificate
    same = c.holonomy_failures == 0 if has_boundary(faces) else agrees(mesh, field, map)
    degrees = [np.degrees(s[key]) for key in ("angle_mean_engine", "angle_mean", "angle_p95")]
    parts = ("seconds_cut", "seconds_conformal", "seconds_newton", "seconds_map")
    spent = sum(s.get(part, 0.0) for part in parts)
    figures = " | ".join(f"{d:.2f}" for d in degrees)
    return (
        f"| {name} | {len(faces)} | {count} | {'yes' if c.ok else 'no'} | {'yes' if same else 'NO'} | {figures} | "
        f"{c.energy:.4g} | {s['added_vertices']} | {spent:.2f} | {cpu:.2f} |",
        c.ok and same,
    )


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", default="", help="cases whose name contains this")
    parser.add_argument("--own", action="store_true", help="our smoothest fields")
    parser.add_argument("--simplify", action="store_true", help="our fields: merge near cones")
    parser.add_argument("--open", choices=("aligned", "free"), help="open models")
    parser.add_argument("--random", type=int, default=0, help="signatures per surface")
    parser.add_argument("--reach", type=int, default=1, help="of random turns, quarters")
    parser.add_argument("--halves", action="store_true", help="random cones of index +-1/2 only")
    parser.add_argument("--engine", choices=("auto", "penner", "padding"), default="auto")
    parser.add_argument("--cuts", action="store_true", help="padding's cuts alone")
    parser.add_argument("--seconds", type=float, default=120.0, help="give a case up after so long")
    parser.add_argument("--markdown", action="store_true")
    arguments = parser.parse_args()
    folder = data_folder()
    if folder is None:
        sys.exit("The shared data folder is not here (FLIPFREE_DATA).")
    columns = CUT_COLUMNS if arguments.cuts else COLUMNS
    print(f"| {columns} |")
    if arguments.markdown:
        print("|" + "---|" * (columns.count("|") + 1))
    cases: Iterator[tuple[Mesh, ff.CrossField | None]]
    if arguments.random > 0:
        a = arguments
        cases = iter(at_random(folder, a.random, a.reach, a.halves, a.only))
    elif arguments.open:
        cases = ((mesh, None) for mesh in opened(folder))
    elif arguments.own:
        cases = ((mesh, None) for mesh in closed(folder))
    else:
        cases = chain(given(folder), given_raw(folder))
    good = total = 0
    for mesh, field in cases:
        if arguments.only not in mesh[0] or (arguments.cuts and genus_of(mesh) < 1):
            continue
        total += 1
        try:
            boundary = arguments.open or "aligned"
            follows = boundary == "aligned"
            own = field or ff.cross_field(
                mesh[1], mesh[2], boundary=follows, simplify=arguments.simplify
            )
            if arguments.cuts:
                text, fine = cut_row(mesh, own)
            else:
                text, fine = row(mesh, own, boundary, arguments.engine, arguments.seconds)
        except ff.FlipfreeError as error:
            text, fine = f"| {mesh[0]} | {len(mesh[2])} | - | no field: {error} |", False
        good += fine
        print(text, flush=True)
    verdict = (
        "turn as the field does" if arguments.cuts else "certified and judged alike, or refused"
    )
    print(f"{good} of {total} {verdict}")
    return int(good < total)


if __name__ == "__main__":
    sys.exit(main())
