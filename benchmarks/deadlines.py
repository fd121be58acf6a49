"""How late every public call comes back when its time is over.

    deadlines.py calls [--only TEXT] [--limits 0.1,1,10] [--limit N]

Every call of the package over a corpus - small, medium and degenerate generated meshes, and the surfaces of the shared data
folder if there is one - with each limit. Cases, results, errors by kind, and per limit the latest return after its end, with the
mesh. A case that ends early in every sense (a result or another error within the limit) counts as not late. Exit status 1 if a
call raised anything but the package's own errors. On a loaded machine the lateness is that of the machine as well.
"""

from __future__ import annotations

import inspect
import time
from collections import Counter
from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

import numpy as np
import numpy.typing as npt
from degenerate_meshes import degenerate_mesh
from embedding_meshes import boundary_loop, corridors, fingers, stacked, tube, wavy_grid
from runner import Options, Row, main, numbers, table

import flipfree as ff

from mesh_files import data_folder, read_mesh
from surfaces import bumpy_grid, cylinder, euler, octahedron_sphere, torus

Case = tuple[str, npt.NDArray[np.float64], npt.NDArray[np.int32]]
LARGEST_FACES = 200_000  # of the data folder
DEGENERATE = 12


def corpus() -> Iterator[Case]:
    yield "grid 8 x 6", *bumpy_grid(8, 6)
    yield "torus 24 x 12", *torus()
    yield "sphere 1k", *octahedron_sphere(4)
    yield "cylinder 64 x 40", *cylinder(64, 40)
    for disk in (
        wavy_grid(150, 100),
        tube(40, 200),
        stacked(8000),
        stacked(4000, "deep"),
        fingers(4, 20),
        corridors(4, 20),
    ):
        yield disk.name, disk.vertices, disk.faces
    yield "sphere 33k", *octahedron_sphere(6)
    for seed in range(DEGENERATE):
        yield f"degenerate {seed}", *degenerate_mesh(np.random.default_rng(seed))
    folder = data_folder()
    for path in sorted(folder.rglob("*.obj")) if folder else []:
        if path.stat().st_size > 100 * LARGEST_FACES:
            continue
        mesh = read_mesh(path)
        yield f"{path.parent.name}/{path.stem}", mesh.vertices, mesh.faces


def is_disk(case: Case) -> bool:
    return len(boundary_loop_or_none(case[2])) > 0 and euler(case[2]) == 1


def boundary_loop_or_none(faces: npt.NDArray[np.int32]) -> npt.NDArray[np.int32]:
    try:
        return boundary_loop(faces)
    except (AssertionError, KeyError):
        return np.zeros(0, np.int32)


def far_angles(case: Case) -> npt.NDArray[np.float64]:
    """Angles far from those of the surface, from the same seed for every limit."""
    angles: npt.NDArray[np.float64] = np.random.default_rng(1).uniform(0.2, 1.0, len(case[1]))
    return angles * (np.pi * len(case[2]) / angles.sum())


def far_pins(case: Case) -> dict[int, tuple[float, float]]:
    random = np.random.default_rng(2)
    loop = boundary_loop_or_none(case[2])
    inner = np.setdiff1d(np.unique(case[2]), loop)
    chosen = random.choice(inner, min(len(inner), 6), replace=False)
    return {
        int(v): (float(x), float(y))
        for v, (x, y) in zip(chosen, random.random((6, 2)), strict=False)
    }


def plain_field(case: Case) -> ff.CrossField:
    """One direction for all faces, projected."""
    return ff.CrossField(np.tile([0.36, 0.48, 0.8], (len(case[2]), 1)))


def turned(uv: npt.NDArray[Any]) -> npt.NDArray[np.float64]:
    return np.asarray(uv, np.float64).reshape(-1, 3, 2)


def spoilt(uv: npt.NDArray[Any]) -> npt.NDArray[np.float64]:
    """With every hundredth vertex, three at least, thrown across the map."""
    random = np.random.default_rng(3)
    corners = turned(uv)
    places, index = np.unique(corners.reshape(-1, 2), axis=0, return_inverse=True)
    thrown = random.choice(len(places), min(len(places), 3 + len(places) // 100), replace=False)
    places[thrown] = places[thrown][::-1]
    return places[index.ravel()].reshape(corners.shape)


class Maps:
    """A certified map of every mesh, made once, for the calls that need one."""

    def __init__(self) -> None:
        self._known: dict[str, Any] = {}

    def of(self, case: Case) -> Any:
        if case[0] not in self._known:
            try:
                self._known[case[0]] = ff.unwrap(case[1], case[2], max_seconds=20, seams="given")
            except ff.FlipfreeError:
                self._known[case[0]] = None
        return self._known[case[0]]


Call = Callable[[Case, float], Any]


def public_calls(maps: Maps) -> dict[str, tuple[Call, Callable[[Case], bool]]]:
    """Name -> (call, whether it takes this mesh)."""

    def many_bits(case: Case, limit: float) -> Any:
        how: dict[str, Any] = {"precision": 4096, "tolerance": 1e-30, "max_seconds": limit}
        return ff.conformal_metric(case[1], case[2], far_angles(case), **how)

    def on_map(call: Callable[..., Any], case: Case, limit: float, spoil: bool = False) -> Any:
        m = maps.of(case)
        return call(m.vertices, m.faces, (spoilt if spoil else turned)(m.uv), max_seconds=limit)

    def on_mesh(call: Callable[..., Any], **more: Any) -> Call:
        return lambda case, limit: call(case[1], case[2], max_seconds=limit, **more)

    def to_angles(call: Callable[..., Any]) -> Call:
        return lambda case, limit: call(case[1], case[2], far_angles(case), max_seconds=limit)

    any_mesh: dict[str, Call] = {
        "unwrap": on_mesh(ff.unwrap, seams="given"),
        "unwrap, automatic seams": on_mesh(ff.unwrap, seams="auto"),
        "auto_seams": on_mesh(ff.auto_seams),
        "conformal_metric": to_angles(ff.conformal_metric),
        "conformal_metric, 4096 bits": many_bits,
        "conformal": to_angles(ff.conformal),
        "suggest_cones": on_mesh(ff.suggest_cones, bound=1.5),
        "suggest_cones, quarters": on_mesh(ff.suggest_cones, quarter_turns=True),
        "cross_field": on_mesh(ff.cross_field, alignment=0.3, simplify=True),
        "field_aligned": on_mesh(ff.field_aligned),
        "quads": on_mesh(ff.quads, target=500),
        "signature": lambda c, s: ff.signature(c[1], c[2], plain_field(c), max_seconds=s),
        "boundary_angles, free": on_mesh(ff.boundary_angles),
        "boundary_angles, circle": on_mesh(ff.boundary_angles, boundary="circle"),
        "seamless": on_mesh(ff.seamless),
        "seamless, padding": on_mesh(ff.seamless, engine="padding"),
        "admissible_cut": lambda c, s: ff.admissible_cut(
            c[1], c[2], field=plain_field(c), max_seconds=s
        ),
        # Linear, without a limit: within any.
        "split_fans": lambda c, _: ff.split_fans(c[2]),
        "islands": lambda c, _: ff.islands(c[2]),
    }
    disks: dict[str, Call] = {
        "embed": on_mesh(ff.embed),
        "embed, optimise": on_mesh(ff.embed, optimise=True),
        "match": lambda c, s: ff.match(c[1], c[2], points=far_pins(c), max_seconds=s),
    }
    mapped: dict[str, Call] = {
        "improve": lambda c, s: ff.improve(maps.of(c), max_seconds=s),
        "quads_from_map": lambda c, s: ff.quads_from_map(maps.of(c), max_seconds=s),
        "fit_tiles": lambda c, s: ff.fit_tiles(maps.of(c), tile=0.1, max_seconds=s),
        "repair": lambda c, s: on_map(ff.repair, c, s, spoil=True),
        "pack": lambda c, s: on_map(ff.pack, c, s),
        "rectify": on_mesh(ff.rectify),
        "certify": lambda c, s: on_map(partial(ff.certify, bijective=True), c, s),
    }
    takes: list[tuple[dict[str, Call], Callable[[Case], bool]]] = [
        (any_mesh, lambda _: True),
        (disks, is_disk),
        (mapped, lambda case: maps.of(case) is not None),
    ]
    return {name: (call, suits) for group, suits in takes for name, call in group.items()}


def without_a_row() -> set[str]:
    """Public calls that take a limit of time, but are not measured here."""
    functions = {n: getattr(ff, n) for n in vars(ff) if inspect.isfunction(getattr(ff, n))}
    limited = {n for n, f in functions.items() if "max_seconds" in inspect.signature(f).parameters}
    return limited - {name.split(",")[0] for name in public_calls(Maps())}


@table("call | cases | results | time limit | other errors | latest return after its limit")
def calls(options: Options) -> Iterator[Row]:
    meshes = list(corpus())
    for name, (call, takes) in options.cases(public_calls(Maps()).items(), lambda item: item[0]):
        count: Counter[str] = Counter()
        latest: dict[float, tuple[float, str]] = {}
        for case in filter(takes, meshes):
            for limit in numbers(options.limits):
                start = time.monotonic()
                try:
                    call(case, limit)
                    kind = "result"
                except ff.FlipfreeError as error:
                    kind = "limit" if error.code == "time limit reached" else "error"
                except Exception as error:
                    kind = "error"
                    options.fail(f"{name}, {case[0]}: {error!r}")
                late = max(0.0, time.monotonic() - start - limit)
                count[kind] += 1
                latest[limit] = max(latest.get(limit, (0.0, "-")), (late, case[0]))
        ends = [f"{limit:g} s: {late:.2f} s ({where})" for limit, (late, where) in latest.items()]
        kinds = count["result"], count["limit"], count["error"]
        yield name, count.total(), *kinds, ", ".join(ends)


if __name__ == "__main__":
    main(__doc__, limits=("0.1,1,10", "seconds"))
