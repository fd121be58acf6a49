"""What every way and device of Match Pins earns: each switched off by itself, on the cases that it is there for.

    PYTHONPATH=build/python python3 benchmarks/match_ablation.py RESULTS.jsonl [--data FOLDER] [--limit 20]
        [--without NAME ...] [--groups NAME ...] [--slowest 60] [--threads 2]
    PYTHONPATH=build/python python3 benchmarks/match_ablation.py RESULTS.jsonl --table

A case that takes longer than the limit, in user seconds, is cancelled and counts as failed. One line of RESULTS.jsonl
per case, those that it has already are not run again; cases slower than --slowest are not run without a device. The table has a row per device: the cases it was run on, how many
of them are certified with everything and without it, and of those that are in both the ratio of user seconds (of the
sums, and in the median), of energies (median, geometric mean) and the sums of added vertices.
"""

from __future__ import annotations

import argparse
import json
import os
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
from embedding_meshes import boundary_loop
from match_constraints import SHAPES, read_targets, ribbon, strip
from match_hilbert import hilbert as curve
from match_hilbert import outline, with_boundary
from match_large import bumpy_square
from match_protocol import piece_of

import flipfree as ff
from flipfree import _native
from flipfree.calls import matching

from cost import timed
from mesh_files import read_mesh
from random_pins import pinned, pins_in_square

Case = tuple[str, str, Any, Any, dict[str, Any]]  # group, name, vertices, faces, request

#: Disks of the protocol, and how many pins.
PROTOCOL = (
    ("constraints/camel_b_uv.obj", (10, 50)),
    ("constraints/cow_uv.obj", (10,)),
    ("conformal/aircraft.obj", (10,)),
    ("general/snail.obj", (10,)),
    ("conformal/disk5k.obj", (10,)),
    ("general/hand_lowres.obj", (10,)),
)
#: The groups of cases in which a device is asked for at all.
GROUPS = {
    "continuation": ("outline", "few free"),
    "homotopy": ("outline", "hilbert"),
    "outline overlay": ("outline", "hilbert"),
    "matchmaker": ("outline", "free", "circle", "hilbert"),
    "coarse": ("large free", "large outline"),
    "planned": ("circle", "large outline"),
    "arms": ("free", "few free", "large free"),
    "pull": ("free", "few free", "circle", "one-to-one", "shape pins"),
    "equal-area metric": ("circle", "large outline"),
    "simplify plane": ("circle", "large outline"),
    "untangle": ("outline", "free", "few free", "circle", "hilbert", "matchmaker"),
    "unfold": ("free", "few free", "circle", "large free"),
    "ease": ("free", "circle", "large free"),
}


def shared(data: Path) -> Iterator[Case]:
    folder = data / "constraints"
    for mesh in ("camel_b", "cow"):
        file = read_mesh(folder / f"{mesh}_uv.obj")
        vertices, faces = file.vertices, file.faces

        def boundary(shape: str, mesh: str = mesh) -> dict[str, Any]:
            target = read_targets(folder / f"{mesh}_uv_bd_{shape}.txt")
            return {"boundary_loop": list(target), "boundary_uv": list(target.values())}

        for shape in (*SHAPES, "circ2"):
            yield "outline", f"{mesh} {shape}", vertices, faces, boundary(shape)
        for count in (3, 10, 30):
            points = read_targets(folder / f"{mesh}_uv_pins{count}.txt")
            few = "free" if count > 10 else "few free"
            yield few, f"{mesh} {count} free", vertices, faces, {"points": points}
            held = {"points": points, **boundary("circ2")}
            yield "circle", f"{mesh} {count} circle", vertices, faces, held
        engine = {"engine": "matchmaker", **boundary("G")}
        yield "matchmaker", f"{mesh} G, matchmaker", vertices, faces, engine
        engine = {"engine": "matchmaker", "points": read_targets(folder / f"{mesh}_uv_pins3.txt")}
        yield "matchmaker", f"{mesh} 3 free, matchmaker", vertices, faces, engine
    vertices, faces, loop = strip(80, 6)
    for turns in (1.4, 2.4):
        target = {"boundary_loop": loop, "boundary_uv": ribbon(vertices, loop, turns)}
        yield "outline", f"ribbon {turns}", vertices, faces, target


def more_pins(data: Path) -> Iterator[Case]:
    """Maps that may not overlap themselves, and pins that change places inside an outline that is not convex."""
    folder = data / "constraints"
    for mesh in ("camel_b", "cow"):
        file = read_mesh(folder / f"{mesh}_uv.obj")
        vertices, faces = file.vertices, file.faces
        for count in (3, 10):
            points = read_targets(folder / f"{mesh}_uv_pins{count}.txt")
            one = {"points": points, "bijective": True}
            yield "one-to-one", f"{mesh} {count} one-to-one", vertices, faces, one
        for shape, count in (("G", 3), ("S", 6), ("G", 10)):
            target = read_targets(folder / f"{mesh}_uv_bd_{shape}.txt")
            held: dict[str, Any] = {
                "boundary_loop": list(target),
                "boundary_uv": list(target.values()),
            }
            result = ff.match(vertices, faces, optimise=False, **held)
            inner = np.setdiff1d(np.unique(faces), list(target))
            chosen = np.random.default_rng(count).choice(inner, count, False)
            corner = {int(v): c for c, v in enumerate(result.faces.ravel())}
            places = result.uv.reshape(-1, 2)[[corner[int(v)] for v in np.roll(chosen, 1)]]
            held["points"] = pinned(chosen, places)
            yield "shape pins", f"{mesh} {shape} {count} pins", vertices, faces, held


def protocol(data: Path) -> Iterator[Case]:
    for name, counts in PROTOCOL:
        vertices, faces = piece_of(data, name)
        for count in counts:
            random = np.random.default_rng(1000 * count)
            points = pins_in_square(np.unique(faces), count, random)
            yield "free", f"{Path(name).stem} {count} random", vertices, faces, {"points": points}


def hilbert(data: Path) -> Iterator[Case]:
    order = 3
    for name in ("camel_b_uv", "cow_uv"):
        file = read_mesh(data / "constraints" / f"{name}.obj")
        vertices, faces, loop = with_boundary(file.vertices, file.faces, 2 * 4**order)
        target = {"boundary_loop": loop, "boundary_uv": outline(order, len(loop))}
        inner = np.setdiff1d(np.unique(faces), loop)
        random = np.random.default_rng(0)
        cells = curve(order)[random.choice(4**order, 3, replace=False)]
        places = cells + random.uniform(-0.15, 0.15, (3, 2))
        held = {**target, "points": pinned(random.choice(inner, 3, replace=False), places)}
        yield "hilbert", f"{name} hilbert {order}", vertices, faces, held


def large() -> Iterator[Case]:
    vertices, faces = bumpy_square(30_000)
    points = pins_in_square(np.arange(len(vertices)), 10, np.random.default_rng(0))
    yield "large free", "30k 10 free", vertices, faces, {"points": points}
    loop = boundary_loop(faces).tolist()
    inner = np.setdiff1d(np.arange(len(vertices)), loop)
    held = {
        "points": pins_in_square(inner, 10, np.random.default_rng(0)),
        "boundary_loop": loop,
        "boundary_uv": vertices[loop, :2],
    }
    yield "large outline", "30k 10 square", vertices, faces, held


def switched(without: str) -> SimpleNamespace:
    """The native module, whose matches have a device switched off."""

    def match(vertices: Any, faces: Any, request: Any, options: Any, threads: int) -> Any:
        devices = [without] if without else []
        return _native.match(vertices, faces, request, {**options, "without": devices}, threads)

    return SimpleNamespace(**{**vars(_native), "match": match})


def run(case: Case, without: str, limit: float, threads: int) -> dict[str, Any]:
    group, name, vertices, faces, request = case
    matching._native = switched(without)
    row: dict[str, Any] = {"without": without, "group": group, "case": name, "ok": False}
    with timed() as clock:
        start = os.times().user
        try:
            result = ff.match(
                vertices,
                faces,
                threads=threads,
                progress=lambda *_: os.times().user - start < limit,
                **request,
            )
        except ff.FlipfreeError as error:
            row["failure"] = f"{type(error).__name__}: {error}"
        else:
            row["ok"] = result.certificate.ok
            row["added"] = result.stats["added_vertices"]
            row["energy"] = result.certificate.energy
            row["engine"] = result.stats["engine"]
    return row | {"user": clock.user}


def table(rows: list[dict[str, Any]]) -> None:
    everything = {row["case"]: row for row in rows if not row["without"]}
    print(
        "| without | cases | certified, with | without | user s | median | energy, median | mean | added, with | without |"
    )
    print("|---|---|---|---|---|---|---|---|---|---|")
    for device in _native.match_devices:
        off = [row for row in rows if row["without"] == device and row["case"] in everything]
        if not off:
            continue
        on = [everything[row["case"]] for row in off]
        both = [(a, b) for a, b in zip(on, off, strict=True) if a["ok"] and b["ok"]]
        seconds = np.array([b["user"] / a["user"] for a, b in both])
        energy = np.array([b["energy"] / a["energy"] for a, b in both])
        total = [sum(pair[i]["user"] for pair in both) for i in (0, 1)]
        added = [sum(pair[i]["added"] for pair in both) for i in (0, 1)]
        print(
            f"| {device} | {len(off)} | {sum(a['ok'] for a in on)} | {sum(b['ok'] for b in off)} "
            f"| x {total[1] / total[0]:.2f} | x {np.median(seconds):.2f} | x {np.median(energy):.3f} "
            f"| x {np.exp(np.log(energy).mean()):.3f} | {added[0]} | {added[1]} |"
        )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("results", type=Path)
    parser.add_argument("--data", default=os.environ.get("FLIPFREE_DATA", "../shared/data"))
    parser.add_argument("--limit", type=float, default=20.0)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--without", nargs="+", default=list(_native.match_devices))
    parser.add_argument("--groups", nargs="+", default=None)
    parser.add_argument("--slowest", type=float, default=60.0, help="user seconds with everything")
    parser.add_argument("--table", action="store_true")
    options = parser.parse_args()
    lines = options.results.read_text().splitlines() if options.results.exists() else []
    rows = [json.loads(line) for line in lines]
    if options.table:
        table(rows)
        return
    data = Path(options.data)
    done = {(row["without"], row["case"]) for row in rows}
    cases = [*shared(data), *more_pins(data), *protocol(data), *hilbert(data), *large()]
    known = {row["case"]: row["user"] for row in rows if not row["without"]}
    for device in ["", *options.without]:
        for case in cases:
            wanted = case[0] in GROUPS.get(device, (case[0],))
            if not wanted or (device, case[1]) in done:
                continue
            if options.groups is not None and case[0] not in options.groups:
                continue
            if device and known.get(case[1], 0.0) > options.slowest:
                continue
            row = run(case, device, options.limit, options.threads)
            with options.results.open("a") as file:
                file.write(json.dumps(row) + "\n")
            print(row, flush=True)


if __name__ == "__main__":
    main()
