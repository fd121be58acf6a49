"""Field-aligned seamless maps: along given and own fields, on open surfaces, cuts, rerouting.

    field_aligned.py given [--engine padding]     fields/ with its fields, the two cones on a torus that no map has among them
    field_aligned.py own [--simplify]             closed models with their smoothest field (near cones merged)
    field_aligned.py opened [--boundary free]     the models of general/ with a boundary, which the field follows if it is aligned
    field_aligned.py cuts                         whole maps of the engine "padding" for fields/: what rerouting does to their cuts
    field_aligned.py rerouting                    what rerouting is for (thesis table 6.2)

`judged`: on a homology basis that nobody has seen, the map turns as the field does (tests/judges); of open surfaces the certificate's
own. Angles are between isolines and field, degrees, by area; `engine` before the alignment. cuts: how many loops turned
otherwise than the field, by how many quarter turns together, and branches that took the shortest detour (guided) or went around cones
one by one (fallback). rerouting: E_A is the mean of |J - T|^2 / 2 by area, E has 1e-3 times the symmetric Dirichlet energy besides.
Exit status 1 if a case is neither certified and judged alike nor refused as Infeasible, or if rerouting makes a map worse.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np
import numpy.typing as npt
from runner import Options, Row, data, main, table, timed

import flipfree as ff

from judges import fields, holonomy
from mesh_files import read_mesh
from surfaces import euler, open_edges

Mesh = tuple[str, npt.NDArray[np.float64], npt.NDArray[np.int32]]
Case = tuple[Mesh, ff.CrossField | None]  # None: the smoothest
NO_SURFACES = ("nonmanifold_toy", "zeroarea_48")
SMOOTHNESS = 1e-3
WAYS = ("padding, rerouted", "padding, as it is", "penner")


def with_fields() -> Iterator[Case]:
    """Fields as vectors (.rawfield) have no matching."""
    folder = data() / "fields"
    for path in [*sorted(folder.glob("*_kappa_hat.gz")), *sorted(folder.glob("*.rawfield"))]:
        name = path.name.removesuffix("_kappa_hat.gz")
        models = path.with_name(name + ".obj"), path.with_suffix(".off"), folder / "torus.obj"
        mesh = read_mesh(next(model for model in models if model.exists()))
        field = ff.CrossField.read(path, mesh.vertices, mesh.faces)
        yield (name, mesh.vertices, mesh.faces), field


def has_boundary(faces: npt.NDArray[np.int32]) -> bool:
    return len(open_edges(faces)) > 0


def models(*patterns: str, open_ones: bool = False) -> Iterator[Mesh]:
    for path in sorted(path for pattern in patterns for path in data().glob(pattern)):
        mesh = read_mesh(path)
        if has_boundary(mesh.faces) == open_ones and path.stem not in NO_SURFACES:
            yield path.stem, mesh.vertices, mesh.faces


def closed() -> Iterator[Mesh]:
    return models("fields/*.obj", "general/*.o??", "embedding/*.obj")


def genus_of(mesh: Mesh) -> int:
    """Of a closed connected one; of several components less one each."""
    return 1 - euler(mesh[2]) // 2


def agrees(mesh: Mesh, field: ff.CrossField, map: ff.Parametrization) -> bool:
    _, vertices, faces = mesh
    basis = holonomy.random_homology_basis(map.faces, 1)
    strips = [fields.projected(faces, map.faces, map.parent_face, loop) for loop in basis]
    wanted = fields.judge(vertices, faces, field.rotation, strips)
    cones = {int(v): int(k) for v, k in enumerate(wanted.cones) if k != 4}
    judged = holonomy.judge(map.faces, map.uv64, cones, basis)
    exact = judged.vertex_error < 1e-6 and judged.loop_error < 1e-6
    return exact and judged.turns == wanted.turns


COLUMNS = (
    "case | F | cones | certified | judged | engine angle | mean angle | 95 % | energy | added V"
    " | engine s | CPU s"
)


def rows(cases: Iterable[Case], options: Options, boundary: str = "aligned") -> Iterator[Row]:
    for mesh, given_field in options.cases(cases, lambda case: case[0][0]):
        name, vertices, faces = mesh
        try:
            field = given_field or ff.cross_field(
                vertices, faces, boundary=boundary == "aligned", simplify=options.simplify
            )
            count = len(ff.signature(vertices, faces, field).cones)
            with timed() as cost:
                map = ff.field_aligned(
                    vertices,
                    faces,
                    field=field,
                    boundary=boundary,
                    engine=options.engine,
                    max_seconds=options.seconds,
                )
        except ff.FlipfreeError as error:
            if not isinstance(error, ff.Infeasible):
                options.fail(f"{name}: {error}")
            yield name, len(faces), "", f"refused: {error.code}", *[""] * 8
            continue
        s, c = map.stats, map.certificate
        same = c.holonomy_failures == 0 if has_boundary(faces) else agrees(mesh, field, map)
        if not (c.ok and same):
            options.fail(f"{name}: certified {c.ok}, judged {same}")
        angles = [np.degrees(s[key]) for key in ("angle_mean_engine", "angle_mean", "angle_p95")]
        parts = ("seconds_cut", "seconds_conformal", "seconds_newton", "seconds_map")
        spent = f"{sum(s.get(part, 0.0) for part in parts):.2f}", f"{cost.cpu:.2f}"
        figures = *[f"{angle:.2f}" for angle in angles], c.energy, s["added_vertices"]
        yield name, len(faces), count, c.ok, same, *figures, *spent


@table(COLUMNS)
def given(options: Options) -> Iterator[Row]:
    yield from rows(with_fields(), options)


@table(COLUMNS)
def own(options: Options) -> Iterator[Row]:
    yield from rows(((mesh, None) for mesh in closed()), options)


@table(COLUMNS)
def opened(options: Options) -> Iterator[Row]:
    found = models("general/*.o??", open_ones=True)
    yield from rows(((mesh, None) for mesh in found), options, options.boundary)


def drawn_cut(mesh: Mesh, field: ff.CrossField, reroute: bool) -> dict[str, Any]:
    _, vertices, faces = mesh
    cut = ff.admissible_cut(vertices, faces, field=field, reroute=reroute)
    ends = cut.vertices[cut.cut_edges]
    length = float(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).sum())
    return {**cut.stats, "length": length, "added_vertices": len(cut.vertices) - len(vertices)}


@table(
    "case | genus | F | loops | quarters off | guided | fallback | added V | added V as it is"
    " | length over that as it is | CPU s"
)
def cuts(options: Options) -> Iterator[Row]:
    for mesh, field in options.cases(with_fields(), lambda case: case[0][0]):
        if genus_of(mesh) < 1:
            continue
        with timed() as cost:
            try:
                s = drawn_cut(mesh, field, True)
            except ff.FlipfreeError as error:
                if not isinstance(error, ff.Infeasible):
                    options.fail(f"{mesh[0]}: {error}")
                continue
        bare = drawn_cut(mesh, field, False)
        done = [s[k] for k in ("loops", "quarters", "guided", "fallback", "added_vertices")]
        ratio = f"{s['length'] / bare['length']:.2f}", f"{cost.cpu:.2f}"
        yield mesh[0], genus_of(mesh), len(mesh[2]), *done, bare["added_vertices"], *ratio


def aligned(mesh: Mesh, field: ff.CrossField, way: str, seconds: float) -> ff.Parametrization:
    _, vertices, faces = mesh
    how: dict[str, Any] = dict(engine=way.split(",")[0], reroute=way != WAYS[1])
    return ff.field_aligned(vertices, faces, field=field, max_seconds=seconds, **how)


@table("model | genus | rerouted | " + " | ".join(f"{way}: E | E_A | mean angle" for way in WAYS))
def rerouting(options: Options) -> Iterator[Row]:
    for mesh, field in options.cases(with_fields(), lambda case: case[0][0]):
        if mesh[0].endswith(".rawfield"):
            continue
        cells: list[str] = []
        total: list[float] = []
        rerouted = 0
        for way in WAYS:
            map = aligned(mesh, field, way, options.seconds)
            if way == WAYS[0]:
                rerouted = map.stats["reroutings.guided"] + map.stats["reroutings.fallback"]
            part = float(map.stats["alignment.energy"])
            total.append(part + SMOOTHNESS * map.certificate.energy)
            angle = np.degrees(map.stats["angle_mean"])
            cells += [f"{total[-1]:.4f}", f"{part:.4f}", f"{angle:.1f}"]
        if rerouted and total[0] >= total[1]:
            options.fail(f"{mesh[0]}: no lower with rerouting")
        yield mesh[0], genus_of(mesh), rerouted, *cells


if __name__ == "__main__":
    main(
        __doc__,
        engine=("auto", "", "auto", "penner", "padding"),
        simplify=(False, "own fields: near cones merged"),
        boundary=("aligned", "", "aligned", "free"),
    )
