"""Maps of broken meshes, damaged at random: does the certificate pass one that another judge finds fault with?

    export PYTHONPATH=build/python:tests:tests/python:benchmarks
    separated_mutations.py [--meshes 2000] [--damages 10] [--seed 0] [--jobs 2]

Each mesh of separated_meshes.py is unwrapped once and its map damaged in many ways, some of which leave it valid. Certificates are
asked for charts that neither overlap themselves nor each other. A certificate that is ok must be so to tests/judges/any_triangles.py
as well, on the given values and on their rounding to 32 bits: exit status 1 if one is not. The other way round is counted: maps
that only the certificate refuses.
"""

from __future__ import annotations

import argparse
import collections
import multiprocessing
from collections.abc import Callable

import numpy as np
import numpy.typing as npt
from broken_meshes import broken_mesh

import flipfree as ff

from judges.any_triangles import judge_any

Corners = npt.NDArray[np.float64]
Random = np.random.Generator
#: Seconds that one mesh may take.
LIMIT = 60.0


def corners_like(
    faces: npt.NDArray[np.int64], uv: Corners, face: int, k: int
) -> npt.NDArray[np.bool_]:
    """The corners at the same vertex and the same point."""
    return (faces == faces[face, k]) & (uv == uv[face, k]).all(axis=2)


def island(faces: npt.NDArray[np.int64], uv: Corners, face: int) -> npt.NDArray[np.bool_]:
    """Faces that share vertices with equal UVs with it, and so on."""
    inside = np.zeros(len(faces), bool)
    inside[face] = True
    keys: dict[tuple[int, float, float], list[int]] = collections.defaultdict(list)
    for f in range(len(faces)):
        for k in range(3):
            keys[(int(faces[f, k]), *uv[f, k].tolist())].append(f)
    front = [face]
    while front:
        f = front.pop()
        for k in range(3):
            for g in keys.pop((int(faces[f, k]), *uv[f, k].tolist()), []):
                if not inside[g]:
                    inside[g] = True
                    front.append(g)
    return inside


def move_vertex(faces: npt.NDArray[np.int64], uv: Corners, random: Random) -> str:
    f, k = int(random.integers(len(faces))), int(random.integers(3))
    same = corners_like(faces, uv, f, k)
    size = np.ptp(uv[f], axis=0).max() * 10.0 ** random.uniform(-9, 1)
    uv[same] = uv[f, k] + random.normal(size=2) * size
    return "a vertex moved"


def move_corner(faces: npt.NDArray[np.int64], uv: Corners, random: Random) -> str:
    f, k = int(random.integers(len(faces))), int(random.integers(3))
    size = np.ptp(uv[f], axis=0).max() * 10.0 ** random.uniform(-9, 0)
    uv[f, k] += random.normal(size=2) * size
    return "a corner torn off"


def snap(faces: npt.NDArray[np.int64], uv: Corners, random: Random) -> str:
    """A vertex onto another point of the map: sides touch, triangles collapse."""
    f, k = int(random.integers(len(faces))), int(random.integers(3))
    to = uv[int(random.integers(len(faces))), int(random.integers(3))].copy()
    uv[corners_like(faces, uv, f, k)] = to
    return "a vertex onto another"


def mirror(faces: npt.NDArray[np.int64], uv: Corners, random: Random) -> str:
    inside = island(faces, uv, int(random.integers(len(faces))))
    uv[inside, :, 0] = uv[inside, :, 0].min() + uv[inside, :, 0].max() - uv[inside, :, 0]
    return "an island mirrored"


def fold_face(faces: npt.NDArray[np.int64], uv: Corners, random: Random) -> str:
    """A corner mirrored at the opposite edge, with all that is joined to it."""
    f, k = int(random.integers(len(faces))), int(random.integers(3))
    a, b, p = uv[f, (k + 1) % 3], uv[f, (k + 2) % 3], uv[f, k]
    along = b - a
    if not along.any():
        return "a face folded"
    foot = a + along * (np.dot(p - a, along) / np.dot(along, along))
    uv[corners_like(faces, uv, f, k)] = 2 * foot - p
    return "a face folded"


def stack(faces: npt.NDArray[np.int64], uv: Corners, random: Random) -> str:
    """An island moved so that a vertex of it lies on a point of the map."""
    f = int(random.integers(len(faces)))
    inside = island(faces, uv, f)
    to = uv[int(random.integers(len(faces))), int(random.integers(3))].copy()
    uv[inside] += to - uv[f, 0]
    return "an island on others"


def cut_face_off(faces: npt.NDArray[np.int64], uv: Corners, random: Random) -> str:
    """A face to a free place, either side up."""
    f = int(random.integers(len(faces)))
    uv[f] += 3.0 + random.uniform(size=2)
    if random.random() < 0.5:
        uv[f, :, 1] *= -1
    return "a face cut off"


def glue(faces: npt.NDArray[np.int64], uv: Corners, random: Random) -> str:
    """A face to an edge of another that it shares in space but not in the map, onto either side of it."""
    f = int(random.integers(len(faces)))
    others = np.flatnonzero(np.isin(faces, faces[f]).sum(axis=1) >= 2)
    others = others[others != f]
    if not len(others):
        return "a face glued"
    g = int(random.choice(others))
    where = {int(v): k for k, v in enumerate(faces[g].tolist())}
    shared = [k for k in range(3) if int(faces[f, k]) in where][:2]
    if len(shared) < 2:
        return "a face glued"
    p, q = (uv[g, where[int(faces[f, k])]].copy() for k in shared)
    tip = 3 - sum(shared)
    uv[f, shared[0]], uv[f, shared[1]] = p, q
    side = (
        np.array([p[1] - q[1], q[0] - p[0]]) * random.choice([-1.0, 1.0]) * random.uniform(0.01, 1)
    )
    uv[f, tip] = (p + q) / 2 + side
    return "a face glued"


def scale(faces: npt.NDArray[np.int64], uv: Corners, random: Random) -> str:
    uv *= 10.0 ** random.uniform(-40, 30)
    return "all scaled"


DAMAGES: list[Callable[[npt.NDArray[np.int64], Corners, Random], str]] = [
    move_vertex, move_corner, snap, mirror, fold_face, stack, cut_face_off, glue, scale,
]  # fmt: skip


def fault(faces: npt.NDArray[np.int64], uv: Corners) -> list[str]:
    with np.errstate(over="ignore"):
        stored = uv.astype(np.float32)
    return judge_any(faces, uv) + judge_any(faces, stored)


def outcome(task: tuple[int, int]) -> tuple[list[tuple[str, bool, bool]], list[str]]:
    """Per damaged map its kind, whether the certificate is ok, whether the judge finds nothing; and what must not be."""
    seed, damages = task
    kind, (vertices, faces) = broken_mesh(seed)
    faces = np.asarray(faces, np.int64)
    try:
        whole = ff.unwrap(vertices, faces, max_seconds=LIMIT, threads=1, seams="given").uv
    except ff.FlipfreeError as error:
        return [], [f"seed {seed} ({kind}): {error}"]
    rows, wrong = [], []
    for number in range(damages):
        random = np.random.default_rng([seed, number])
        uv = np.array(whole, np.float64)
        damage = DAMAGES[int(random.integers(len(DAMAGES)))]
        words = damage(faces, uv, random)
        if random.random() < 0.3:
            words += " and " + DAMAGES[int(random.integers(len(DAMAGES)))](faces, uv, random)
        with np.errstate(over="ignore"):
            storable = np.isfinite(uv.astype(np.float32)).all()
        if not storable:
            continue
        certificate = ff.certify(vertices, faces, uv, bijective=True, disjoint=True, threads=1)
        found = fault(faces, uv)
        rows.append((damage.__name__, certificate.ok, not found))
        if certificate.ok and found:
            wrong.append(f"seed {seed} ({kind}), damage {number} ({words}): {'; '.join(found)}")
    return rows, wrong


def main() -> int:
    parser = argparse.ArgumentParser()
    parser.add_argument("--meshes", type=int, default=2000)
    parser.add_argument("--damages", type=int, default=10)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--jobs", type=int, default=2)
    options = parser.parse_args()
    count: collections.Counter[tuple[str, bool, bool]] = collections.Counter()
    failed = False
    tasks = [(s, options.damages) for s in range(options.seed, options.seed + options.meshes)]
    with multiprocessing.Pool(options.jobs) as pool:
        for rows, wrong in pool.imap(outcome, tasks, chunksize=16):
            count.update(rows)
            failed = failed or bool(wrong)
            for sentence in wrong:
                print(sentence, flush=True)
    print(
        "| damage | maps | both find nothing | both find fault | only the certificate does | only the judge does |"
    )
    print("|---|---|---|---|---|---|")
    for name in sorted({key[0] for key in count}):
        figures = [
            count[(name, *verdict)]
            for verdict in ((True, True), (False, False), (False, True), (True, False))
        ]
        print(f"| {name} | {sum(figures)} | {' | '.join(map(str, figures))} |")
    return 1 if failed else 0


if __name__ == "__main__":
    raise SystemExit(main())
