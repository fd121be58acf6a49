"""Have results changed? Every public call over the corpus, compared to the last bit with what an earlier build gave.

    same_results.py write FILE [--only TEXT] [--faces 30000]
    same_results.py compare BEFORE AFTER

`write` notes a row per case: a hash of the surface, of the coordinates in 64 and of those stored in 32 bits, the certificate's
numbers, or the error's text. Inputs: the meshes of tests/surfaces.py, and the shared data folder's up to --faces triangles where
it is there. `compare` prints the rows that differ; exit status 1 if there are any.
"""

from __future__ import annotations

import argparse
import dataclasses
import hashlib
import json
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from conformal import pairs_of
from match import held, read_targets
from runner import timed
from seamless import prescribed

import flipfree as ff

from mesh_files import data_folder, read_mesh
from surfaces import bumpy_grid, cylinder, octahedron_sphere, torus

Case = tuple[str, Callable[[], Any]]


def digest(*arrays: Any) -> str:
    text = hashlib.sha256()
    for array in arrays:
        array = np.ascontiguousarray(array)
        text.update(f"{array.dtype}{array.shape}".encode())
        text.update(array.tobytes())
    return text.hexdigest()[:16]


def numbers(certificate: Any) -> dict[str, Any]:
    return {
        field.name: repr(value)
        for field in dataclasses.fields(certificate)
        if isinstance(value := getattr(certificate, field.name), bool | int | float)
    }


def row(result: Any) -> dict[str, Any]:
    if isinstance(result, ff.Parametrization):
        return {
            "surface": digest(result.vertices, result.faces, result.parent_face),
            "uv": digest(result.uv),
            "stored": digest(result.uv32()),
            "cut": digest(result.cut_edges),
            "energy": repr(result.certificate.energy),
            "certificate": numbers(result.certificate),
        }
    return {"values": digest(result)}


def mesh_calls(name: str, vertices: np.ndarray, faces: np.ndarray, seams: Any) -> Iterator[Case]:
    """What any mesh can be asked for."""
    yield f"unwrap {name}", lambda: ff.unwrap(vertices, faces, cuts=seams)
    yield f"auto {name}", lambda: ff.unwrap(vertices, faces, cuts=seams, seams="auto")
    yield f"field {name}", lambda: ff.cross_field(vertices, faces).directions
    yield f"aligned {name}", lambda: ff.field_aligned(vertices, faces)


def own() -> Iterator[Case]:
    disk, ball, ring, tube = bumpy_grid(40, 40), octahedron_sphere(4), torus(), cylinder()
    for name, mesh in (("disk", disk), ("ball", ball), ("torus", ring), ("cylinder", tube)):
        yield from mesh_calls(name, *mesh, None)
    for shape in ("circle", "square", "triangle"):
        yield f"embed {shape}", lambda shape=shape: ff.embed(*disk, boundary=shape)
        yield f"embed best {shape}", lambda s=shape: ff.embed(*disk, boundary=s, optimise=True)
    pins = {0: (0.0, 0.0), 700: (1.0, 0.3), 900: (0.2, 1.0)}
    yield "match", lambda: ff.match(*disk, points=pins)
    yield "pins", lambda: ff.unwrap(*disk, pins=pins)
    flat = np.full(len(ball[0]), 2 * np.pi)
    flat[:4] = np.pi
    yield "metric", lambda: ff.conformal_metric(*ball, flat).scale_factors
    yield "conformal", lambda: ff.conformal(*ball, flat)
    cones = {v: 3 for v in range(8)}
    for engine in ("penner", "padding"):
        yield f"seamless {engine}", lambda e=engine: ff.seamless(*ball, cones, engine=e)
    yield "angles", lambda: ff.boundary_angles(*disk, "circle")
    yield "cones", lambda: np.asarray(ff.suggest_cones(*disk))
    yield "repair", lambda: ff.repair(*ball, np.zeros((len(ball[1]), 3, 2)))


def shared(folder: Path, most_faces: int) -> Iterator[Case]:
    for part in ("embedding", "general", "hard", "seams"):
        for path in sorted((folder / part).iterdir()):
            if path.suffix not in (".obj", ".off"):
                continue
            try:
                mesh = read_mesh(path)
            except ff.FlipfreeError as error:
                yield f"read {path.name}", lambda e=error: np.frombuffer(str(e).encode(), np.uint8)
                continue
            if len(mesh.faces) <= most_faces:
                yield from mesh_calls(path.name, mesh.vertices, mesh.faces, mesh.seams)
    for path in sorted((folder / "constraints").glob("*_uv.obj")):
        mesh = read_mesh(path)
        assert mesh.uv is not None
        uv = np.zeros((len(mesh.vertices), 2))
        uv[mesh.faces.ravel()] = mesh.uv.reshape(-1, 2)
        for targets in sorted(path.parent.glob(f"{path.stem}_pins*.txt")):
            pins = read_targets(targets)
            yield (
                f"match {targets.stem}",
                lambda m=mesh, p=pins: ff.match(m.vertices, m.faces, points=p),
            )
        for targets in sorted(path.parent.glob(f"{path.stem}_bd_*.txt")):
            outline = held(read_targets(targets))
            yield (
                f"match {targets.stem}",
                lambda m=mesh, o=outline: ff.match(m.vertices, m.faces, **o),
            )
    for model, path in pairs_of(folder / "conformal"):
        mesh, angles = read_mesh(model), np.loadtxt(path)
        if len(mesh.faces) <= most_faces and len(angles) == len(mesh.vertices):
            yield (
                f"metric {path.name}",
                lambda m=mesh, a=angles: (
                    ff.conformal_metric(m.vertices, m.faces, a, max_seconds=60).scale_factors
                ),
            )
    for case in prescribed():
        if len(case.faces) <= most_faces:
            for engine in ("penner", "padding"):
                yield (
                    f"seamless {engine} {case.name}",
                    lambda c=case, e=engine: ff.seamless(
                        c.vertices, c.faces, c.cones, engine=e, max_seconds=120
                    ),
                )


def write(path: Path, only: str, most_faces: int) -> int:
    folder = data_folder()
    cases = [*own(), *(shared(folder, most_faces) if folder else ())]
    rows: dict[str, Any] = {}
    for name, call in cases:
        if only not in name:
            continue
        with timed() as cost:
            try:
                rows[name] = row(call())
            except ff.FlipfreeError as error:
                rows[name] = {"error": type(error).__name__, "text": str(error)}
        rows[name]["seconds"] = round(cost.cpu, 2)
        path.write_text(json.dumps(rows, indent=1))
    total = sum(r["seconds"] for r in rows.values())
    refused = sum("error" in r for r in rows.values())
    print(
        f"{len(rows)} cases, {refused} of them errors, {total:.0f} CPU s"
        + ("" if folder else "; no shared data")
    )
    return 0


def compare(before: Path, after: Path) -> int:
    old, new = json.loads(before.read_text()), json.loads(after.read_text())
    names = [name for name in old if name in new]
    different = 0
    for name in names:
        changed = [
            key
            for key in sorted({*old[name], *new[name]} - {"seconds"})
            if old[name].get(key) != new[name].get(key)
        ]
        if changed:
            different += 1
            print(f"{name}: {', '.join(changed)}")
            if "energy" in changed:
                print(f"    energy {old[name].get('energy')} -> {new[name].get('energy')}")
    seconds = [sum(rows[name]["seconds"] for name in names) for rows in (old, new)]
    print(
        f"{len(names)} cases in both, {different} differ; CPU s {seconds[0]:.0f} -> {seconds[1]:.0f}"
    )
    return 1 if different or not names else 0


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    verbs = parser.add_subparsers(dest="verb", required=True)
    writer = verbs.add_parser("write")
    writer.add_argument("file", type=Path)
    writer.add_argument("--only", default="", help="cases with this text in their names")
    writer.add_argument("--faces", type=int, default=30000)
    comparer = verbs.add_parser("compare")
    comparer.add_argument("before", type=Path)
    comparer.add_argument("after", type=Path)
    arguments = parser.parse_args()
    if arguments.verb == "write":
        return write(arguments.file, arguments.only, arguments.faces)
    return compare(arguments.before, arguments.after)


if __name__ == "__main__":
    sys.exit(main())
