"""ff.embed: beside published codes, every outer face.

    embedding.py speed        pure progressive embedding, the ladder, and with optimisation, beside published codes' seconds
    embedding.py faces        a closed mesh (thesis' Propeller) once for each of its faces as the outer triangle

Disks: the shared data folder's embedding/, closed meshes without their last face. speed: into the equilateral
triangle, or the given circle (retinal); theirs are user seconds from the folder's README (same kind of machine) and thesis table 3.1.
Energies: mean symmetric Dirichlet of the certified 32-bit result, 1 is isometric. Exit status 1 if anything is not certified.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from typing import Any

import numpy as np
from embedding_meshes import Disk, corpus
from runner import Options, Row, data, main, table, timed

import flipfree as ff

from mesh_files import read_mesh
from surfaces import euler, open_edges

#: Name -> authors' progressive embedding, foldover-free maps, thesis table 3.1; None: no figure.
THEIRS = {
    "62415_sf": (13.8, 10.4, 11.6),
    "retinal_random_init": (42.0, 2.9, 95.0),
    "octopus_f500": (18.0, 44.0, None),
    "human_f10575": (759.0, 289.0, None),
    "scorpion_f12624": (1200.0, 222.0, None),
    "tube_n8_L60": (16.8, None, None),
    "nested_tri_200": (18.5, None, None),
    "stacked_100": (0.35, None, None),
}
METHODS = ("ladder", "progressive")


def embedded(disk: Disk, options: Options, **how: Any) -> tuple[ff.Parametrization, float]:
    """The map and its CPU seconds."""
    with timed() as cost:
        result = ff.embed(disk.vertices, disk.faces, **how)
    if not result.certificate.ok:
        options.fail(f"{disk.name}, {how}: not certified")
    return result, cost.cpu


def ratio(theirs: float | None, ours: float) -> str:
    return "" if theirs is None else f"{theirs:g} ({theirs / ours:.0f} x)"


def random_start(disk: Disk, seed: int) -> Any:
    return np.random.default_rng(seed).random((len(disk.vertices), 2))


@table(
    "mesh | triangles | progressive from Tutte: CPU s, E | from nothing: CPU s, E | random: CPU s"
    " | authors' code s (ratio) | thesis table 3.1 s (ratio) | ladder: CPU s, rung"
    " | foldover-free s (ratio) | ladder + optimisation: CPU s, E at start, E"
)
def speed(options: Options) -> Iterator[Row]:
    for disk in options.cases(corpus(), lambda disk: disk.name):
        how: dict[str, Any] = {"boundary": "triangle"}
        start = random_start(disk, 0)
        if (
            disk.name == "retinal_random_init" and disk.uv is not None
        ):  # the file's own random start
            how, start = {"boundary": disk.uv[disk.loop], "boundary_loop": disk.loop}, disk.uv
        if disk.name.startswith("fingers"):
            how = {"boundary": "circle"}
        ways: dict[str, dict[str, Any]] = {
            "Tutte": {"method": "progressive"},
            "nothing": {"method": "progressive", "start": "nothing"},
            "random": {"method": "progressive", "initial_uv": start},
            "ladder": {},
            "optimised": {"optimise": True},
        }
        found = {name: embedded(disk, options, **how, **way) for name, way in ways.items()}
        seconds = {name: cpu for name, (_, cpu) in found.items()}
        energy = {name: result.certificate.energy for name, (result, _) in found.items()}
        slowest = max(seconds[name] for name in ("Tutte", "nothing", "random"))
        authors, foldover, thesis = THEIRS.get(disk.name, (None, None, None))
        first = found["optimised"][0].stats["energy_embedding"]
        yield (
            disk.name,
            len(disk.faces),
            *[f"{seconds[name]:.3f}, {energy[name]:.3g}" for name in ("Tutte", "nothing")],
            f"{seconds['random']:.3f}",
            ratio(authors, slowest),
            ratio(thesis, slowest),
            f"{seconds['ladder']:.4f}, {found['ladder'][0].stats['rung']}",
            ratio(foldover, seconds["ladder"]),
            f"{seconds['optimised']:.2f}, {first:.3g}, {energy['optimised']:.4g}",
        )


@table("method | certified | rungs | CPU ms: mean, largest")
def faces(options: Options) -> Iterator[Row]:
    mesh = read_mesh(data() / "embedding" / "62415_sf.obj")
    for method in options.cases(METHODS):
        seconds = []
        rungs: Counter[str] = Counter()
        for f in range(len(mesh.faces))[: options.limit]:
            disk = Disk(f"face {f}", mesh.vertices, np.delete(mesh.faces, f, axis=0))
            result, cpu = embedded(disk, options, boundary="triangle", method=method)
            rungs[result.stats["rung"]] += result.certificate.ok
            seconds.append(1e3 * cpu)
        good = f"{rungs.total()} of {len(seconds)}"
        yield method, good, ", ".join(rungs), f"{np.mean(seconds):.2f}, {max(seconds):.1f}"


def spheres() -> Iterator[Any]:
    """Closed surfaces of genus 0 of the shared data, each once."""
    paths = {path.stem: path for path in sorted(data().glob("*/*.o[bf][jf]"))}
    for name, path in paths.items():
        mesh = read_mesh(path)
        sphere = len(open_edges(mesh.faces)) == 0 and euler(mesh.faces) == 2
        if sphere and len(mesh.faces) < 20000 and not ff.separate(mesh.vertices, mesh.faces).mends:
            yield name, mesh


@table(
    "surfaces | outer faces | Tutte flips in 64 bits | only in 32 bits | ladder certified | most"
)
def rate(options: Options) -> Iterator[Row]:
    """Twenty outer faces of each surface, evenly by number; the triangle is the boundary."""
    flipped: Counter[str] = Counter()
    only32 = count = good = surfaces = 0
    for name, mesh in options.cases(spheres(), lambda case: case[0]):
        surfaces += 1
        for f in np.linspace(0, len(mesh.faces) - 1, 20).astype(int):
            disk = Disk(f"{name}, face {f}", mesh.vertices, np.delete(mesh.faces, f, axis=0))
            count += 1
            try:
                ff.embed(disk.vertices, disk.faces, boundary="triangle", method="tutte")
            except ff.NotConverged as error:
                in_doubles = error.certificate is None or error.certificate.flips64 > 0
                flipped[name] += in_doubles
                only32 += not in_doubles
            good += embedded(disk, options, boundary="triangle")[0].certificate.ok
    worst = ", ".join(f"{name} {n} of 20" for name, n in flipped.most_common(2))
    share = f"{flipped.total()} ({flipped.total() / count:.1%})"
    yield surfaces, count, share, only32, f"{good} of {count}", worst


if __name__ == "__main__":
    main(__doc__)
