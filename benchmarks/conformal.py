"""Conformal metrics and maps: the thesis' experiments 4.6, the pairs of the shared data folder, needles, suggested cones.

    conformal.py metrics [--bits 100]  every pair mesh / angles of conformal/; precision "auto", tolerance 1e-10
    conformal.py maps                  the same pairs mapped or refused, with their certificates
    conformal.py random [--count 100]  random angles on spheres, random boundaries of a disk (thesis 4.6.1)
    conformal.py degeneration [--count 100]   flips at degenerations beside it, on the smaller sphere (thesis 4.6.2)
    conformal.py flips [--count 100]   flips by type on that disk
    conformal.py bits [--count 20]     what each precision reaches in at most 50 steps (thesis 4.6.3)
    conformal.py holes                 one cone takes all curvature of plates with holes (thesis figure 4.11)
    conformal.py sweep                 spheres with a share of sharp angles, in two clusters and scattered (thesis figure 4.21)
    conformal.py needles               what intrinsic refinement of the start does (thesis 4.6.4)
    conformal.py cones                 what ff.suggest_cones reaches with whole quarter turns

Seeds are fixed. `reference`: seconds of the public code of the thesis' authors, from the data folder's README. Needles: prisms as
CAD programs write them, hulls of clusters of points, strips with steep cones; "few": twelve cones of quarter turns, "random": every
angle in (pi, 3 pi). Exit status 1 if a case misses its tolerance, or a certificate that is not ok is returned without an error.
Spheres need scipy.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from runner import Options, Row, data, main, table, timed

import flipfree as ff
from flipfree.results import FLIP_TYPES

from mesh_files import read_mesh
from surfaces import Mesh, open_edges, prism, strip_of_needles

Array = npt.NDArray[np.float64]
Case = tuple[str, Mesh, Array]
#: Seconds of the metric, and of metric and overlay.
REFERENCE = {
    "aircraft": 0.07, "fertility_tri": 0.75, "elephant": 0.65, "1146164_cut": 0.08, "cup_input_simple_10000_cut": 0.39,
    "fertility_input_cut": 0.29, "gtorus006_singlecone": 115.0,
}  # fmt: skip
REFERENCE_MAPS = {"aircraft": 0.48, "fertility_tri": 4.3, "elephant": 9.2}
GENERA = (3, 6, 10, 15, 22, 30, 40, 50, 60, 70, 80, 100, 150)
MANTISSAS = (53, 75, 100, 125, 150)
SHARES = (0.05, 0.1, 0.2, 0.3, 0.4, 0.5)


def pairs_of(folder: Path) -> Iterator[tuple[Path, Path]]:
    """Model and angles: X_Th_hat or X_<case>_Th_hat belongs to the longest X.obj that fits."""
    models = sorted(folder.glob("*.obj"), key=lambda path: -len(path.stem))
    for path in sorted(folder.glob("*_Th_hat")):
        yield next(model for model in models if path.name.startswith(f"{model.stem}_")), path


def pairs(options: Options) -> Iterator[Case]:
    for model, path in options.cases(pairs_of(data() / "conformal"), lambda pair: pair[1].name):
        mesh = read_mesh(model)
        yield path.name.removesuffix("_Th_hat"), (mesh.vertices, mesh.faces), np.loadtxt(path)


def solve(mesh: Mesh, target: Any, **more: Any) -> tuple[ff.ConformalMetric, float]:
    with timed() as cost:
        metric = ff.conformal_metric(*mesh, target, require_convergence=False, **more)
    return metric, cost.cpu


@table("case | V | steps | bits | error | range of u | flips | relaxed | CPU s | reference s")
def metrics(options: Options) -> Iterator[Row]:
    for name, mesh, target in pairs(options):
        how = {"precision": options.bits, "tolerance": 1e-16} if options.bits else {}
        m, seconds = solve(mesh, target, max_seconds=options.seconds, **how)
        if m.angle_error > 1e-10:
            options.fail(f"{name}: {m.angle_error}")
        figures = m.iterations, m.bits, f"{m.angle_error:.1e}", f"{m.scale_range:.1f}", m.flips
        relaxed = m.stats["relaxed_iterations"]
        yield name, len(mesh[0]), *figures, relaxed, f"{seconds:.3f}", REFERENCE.get(name)


@table(
    "case | V | steps | bits | error | range of u | outcome | added V | flips 64 / 32"
    " | metric s | map s | reference s"
)
def maps(options: Options) -> Iterator[Row]:
    for name, mesh, target in pairs(options):
        with timed() as cost:
            try:
                result, refusal = ff.conformal(*mesh, target, max_seconds=options.seconds), None
            except ff.NotConverged as error:
                result, refusal = None, error
        reference = REFERENCE_MAPS.get(name)
        if result is None:
            m = getattr(refusal, "metric", None)
            known = ["", "", "", ""]
            if m is not None:
                known = [m.iterations, m.bits, f"{m.angle_error:.1e}", f"{m.scale_range:.1f}"]
            outcome = f"metric only: {refusal.code}"
            yield name, len(mesh[0]), *known, outcome, "", "", f"{cost.wall:.3f}", "", reference
            continue
        s, c = result.stats, result.certificate
        if not c.ok:
            options.fail(f"{name}: not certified")
        figures = s["iterations"], s["bits"], f"{s['angle_error']:.1e}", f"{s['scale_range']:.1f}"
        own = s["seconds_map"]
        more_figures = "certified", s["added_vertices"], f"{c.flips64} / {c.flips32}"
        spent = f"{cost.wall - own:.3f}", f"{own:.3f}", reference
        yield name, len(mesh[0]), *figures, *more_figures, *spent


def hull(points: Array) -> Mesh:
    """Of points that are put on the unit sphere."""
    from scipy.spatial import ConvexHull

    points = points / np.linalg.norm(points, axis=1)[:, None]
    faces = ConvexHull(points).simplices.astype(np.int32)
    p = points[faces]
    inward = np.einsum("ij,ij->i", np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]), p.sum(1)) < 0
    faces[inward] = faces[inward][:, ::-1]
    return points, faces


def sphere(count: int) -> Mesh:
    """Fibonacci points, jittered by a third of their spacing."""
    i = np.arange(count) + 0.5
    z, a = 1 - 2 * i / count, np.pi * (1 + np.sqrt(5)) * i
    points = np.stack([np.sqrt(1 - z * z) * np.cos(a), np.sqrt(1 - z * z) * np.sin(a), z], axis=1)
    scale = 0.33 * np.sqrt(4 * np.pi / count) / 2
    return hull(points + np.random.default_rng(0).normal(scale=scale, size=points.shape))


def disk(rings: int) -> Mesh:
    """Rings of 6 k vertices: 1 + 3 R (R + 1) of them; slightly domed."""
    points = [(0.0, 0.0, 1.0)]
    for r in range(1, rings + 1):
        a = 2 * np.pi * np.arange(6 * r) / (6 * r)
        s = r / rings
        points += [(s * np.cos(x), s * np.sin(x), 1 - 0.5 * s * s) for x in a]
    first = [0] + [1 + 3 * r * (r - 1) for r in range(1, rings + 2)]
    faces = []
    for r in range(1, rings + 1):
        inner, outer = max(1, 6 * (r - 1)), 6 * r
        for side in range(6):
            for k in range(r):
                o0 = first[r] + (side * r + k) % outer
                o1 = first[r] + (side * r + k + 1) % outer
                i0 = first[r - 1] + (side * (r - 1) + k) % inner
                faces.append((i0, o0, o1))
                if k + 1 < r:
                    faces.append((i0, o1, first[r - 1] + (side * (r - 1) + k + 1) % inner))
    return np.array(points), np.array(faces, np.int32)


def plate(genus: int, hole: int = 3, wall: int = 2, smoothing: int = 2) -> Mesh:
    """With `genus` square holes in rows, as the shared gtorusNNN: voxels, thickness `wall`, corners smoothed."""
    columns = int(np.ceil(np.sqrt(genus))) if genus > 6 else genus
    period = hole + wall
    filled = np.ones((period * columns + wall, period * -(-genus // columns) + wall, wall), bool)
    for h in range(genus):
        x, y = period * (h % columns) + wall, period * (h // columns) + wall
        filled[x : x + hole, y : y + hole] = False
    padded = np.pad(filled, 1)
    quads = []
    for axis in range(3):
        for sign in (0, 1):
            here = padded & ~np.roll(padded, -1 if sign else 1, axis)
            for cell in np.argwhere(here):
                corner = cell.copy()
                corner[axis] += sign
                u, v = np.zeros(3, int), np.zeros(3, int)
                u[(axis + 1) % 3] = 1
                v[(axis + 2) % 3] = 1
                quad = [corner, corner + u, corner + u + v, corner + v]
                quads.append(quad if sign else quad[::-1])
    keys, index = np.unique(np.array(quads).reshape(-1, 3), axis=0, return_inverse=True)
    q = index.reshape(-1, 4)
    faces = np.concatenate([q[:, [0, 1, 2]], q[:, [0, 2, 3]]]).astype(np.int32)
    points = keys.astype(float)
    for _ in range(smoothing):
        total, count = np.zeros_like(points), np.zeros(len(points))
        for k in range(3):
            np.add.at(total, faces[:, k], points[faces[:, (k + 1) % 3]])
            np.add.at(count, faces[:, k], 1)
        points = 0.5 * (points + total / count[:, None])
    return points, faces


def every_angle(mesh: Mesh, seed: int) -> Array:
    """In (pi, 3 pi), shifted to meet Gauss-Bonnet on a sphere."""
    target = np.random.default_rng(seed).uniform(np.pi, 3 * np.pi, len(mesh[0]))
    return target + (np.pi * len(mesh[1]) - target.sum()) / len(target)


def rim_angles(mesh: Mesh, spread: float, seed: int) -> Array:
    """Flat inside; geodesic curvature within +-spread on the boundary, all angles > 0.01."""
    rim = np.unique(open_edges(mesh[1]))
    target = np.full(len(mesh[0]), 2 * np.pi)
    chance = np.random.default_rng(seed)
    while True:
        kappa = chance.uniform(-spread, spread, len(rim))
        kappa += (2 * np.pi - kappa.sum()) / len(kappa)
        if (np.pi - kappa).min() > 0.01:
            target[rim] = np.pi - kappa
            return target


def spreads(count: int) -> Array:
    return np.random.default_rng(99).uniform(0.05, 0.95, count)


@table("surface | cases | within 1e-10 | steps: least, mean, most | CPU s: mean, most | bits")
def random(options: Options) -> Iterator[Row]:
    round_disk = disk(40)
    wide = np.pi * spreads(options.count)
    targets: dict[str, tuple[Mesh, Callable[[Mesh, int], Array]]] = {
        "sphere, 1000 vertices": (sphere(1000), every_angle),
        "sphere, 10 000 vertices": (sphere(10_000), every_angle),
        "disk, 4921 vertices": (round_disk, lambda mesh, i: rim_angles(mesh, wide[i], i)),
    }
    for name in options.cases(targets):
        mesh, target = targets[name]
        found = [solve(mesh, target(mesh, i)) for i in range(options.count)]
        good = sum(m.angle_error <= 1e-10 for m, _ in found)
        if good < len(found):
            options.fail(f"{name}: {len(found) - good} above 1e-10")
        steps, seconds = [m.iterations for m, _ in found], [s for _, s in found]
        bits = ", ".join(f"{k}: {n}" for k, n in sorted(Counter(m.bits for m, _ in found).items()))
        counts = f"{min(steps)}, {np.mean(steps):.1f}, {max(steps)}"
        yield name, len(found), good, counts, f"{np.mean(seconds):.3f}, {max(seconds):.3f}", bits


@table(
    "angles, flips | cases | largest error | systems solved: mean, most | flips: mean, most | CPU s"
)
def degeneration(options: Options) -> Iterator[Row]:
    from degeneration_flips import Metric

    ball = sphere(1000)
    random = [(ball, every_angle(ball, i)) for i in range(options.count)]
    cases = {name: [(mesh, t)] for name, mesh, t in pairs(options) if "sphere1k" in name}
    for name in options.cases({"random": random} | cases):
        found: list[list[Any]] = [[], []]
        for mesh, target in random if name == "random" else cases[name]:
            ours, seconds = solve(mesh, target)
            theirs = Metric(mesh)
            with timed() as cost:
                solved, error = theirs.newton(target, 1e-10, 2000)
            found[0].append((ours.iterations, ours.flips, ours.angle_error, seconds))
            found[1].append((solved, theirs.flips, error, cost.cpu))
        for kind, rows in zip(("Delaunay", "at degenerations, in Python"), found, strict=True):
            systems, flipped, errors, spent = map(np.array, zip(*rows, strict=True))
            counts = (
                f"{systems.mean():.1f}, {systems.max()}",
                f"{flipped.mean():.0f}, {flipped.max()}",
            )
            error = f"{errors.max():.1e}"
            yield f"{name}, {kind}", len(rows), error, *counts, f"{spent.mean():.2f}"


@table("spread of boundary curvature / pi | " + " | ".join(FLIP_TYPES))
def flips(options: Options) -> Iterator[Row]:
    mesh = disk(40)
    wide = spreads(options.count)
    counts = np.array(
        [solve(mesh, rim_angles(mesh, np.pi * s, i))[0].flip_counts for i, s in enumerate(wide)]
    )
    for low in np.arange(0.05, 0.95, 0.15):
        chosen = counts[(wide >= low) & (wide < low + 0.15)]
        if len(chosen):
            yield f"{low:.2f} - {low + 0.15:.2f}", *[f"{x:.1f}" for x in chosen.mean(axis=0)]


@table("bits | median error | worst error | units of the last place (median)")
def bits(options: Options) -> Iterator[Row]:
    mesh = sphere(1000)
    for b in MANTISSAS:
        how = {"precision": b, "tolerance": 2.0 ** (-b - 20), "iterations": 50}
        found = [solve(mesh, every_angle(mesh, i), **how)[0] for i in range(options.count)]
        errors = np.array([min(m.error_history) for m in found])
        median = float(np.median(errors))
        yield b, f"{median:.1e}", f"{errors.max():.1e}", f"{median * 2.0**b:.0f}"


def plates(options: Options) -> Iterator[Case]:
    names = [f"{genus} holes" for genus in GENERA] + [f"{g} holes, 400 bits" for g in (150, 400)]
    for name in options.cases(names):
        genus = int(name.split()[0])
        mesh = plate(genus)
        target = np.full(len(mesh[0]), 2 * np.pi)
        target[0] = (
            2 * np.pi * (2 * genus - 1)
        )  # the last vertex may be beside places without holes
        yield name, mesh, target


@table("case | V | steps | bits | error | range of u | flips | CPU s")
def holes(options: Options) -> Iterator[Row]:
    """As many bits as in the thesis."""
    for name, mesh, target in [*plates(options), *pairs(options)]:
        if "holes" not in name and "singlecone" not in name:
            continue
        bits, tolerance = (400, 1e-65) if name.endswith("400 bits") else (200, 1e-29)
        how: dict[str, Any] = {"tolerance": tolerance, "max_seconds": options.seconds}
        m, seconds = solve(mesh, target, precision=bits, **how)
        if m.angle_error > tolerance:
            options.fail(f"{name}: {m.angle_error}")
        figures = m.iterations, m.bits, f"{m.angle_error:.1e}", f"{m.scale_range:.1f}", m.flips
        yield name, len(mesh[0]), *figures, f"{seconds:.2f}"


@table("vertices | " + " | ".join(f"{share:g} sharp" for share in SHARES))
def sweep(options: Options) -> Iterator[Row]:
    """Errors in doubles, of scattered ones in doubles, and of clusters with 150 bits."""
    for count in (250, 500, 1000):
        mesh, cells = sphere(count), []
        orders = np.argsort(mesh[0][:, 2]), np.random.default_rng(0).permutation(count)
        for share in SHARES:
            sharp, errors = round(share * count), []
            for order, precision in ((orders[0], 53), (orders[1], 53), (orders[0], 150)):
                rest = (2 * np.pi * (count - 2) - 3 * sharp) / (count - sharp)
                target = np.where(np.argsort(order) < sharp, 3.0, rest)
                m, _ = solve(mesh, target, precision=precision, max_seconds=options.seconds)
                errors.append(f"{m.angle_error:.0e}")
            if m.angle_error > 1e-10:
                options.fail(f"{count} vertices, {share:g} sharp: {m.angle_error}")
            cells.append(", ".join(errors))
        yield str(count), *cells


def clusters(size: float) -> Mesh:
    chance = np.random.default_rng(1)
    centres = chance.normal(size=(6, 3))
    centres /= np.linalg.norm(centres, axis=1)[:, None]
    groups = [c + size * chance.normal(size=(100, 3)) for c in centres]
    return hull(np.concatenate([*groups, chance.normal(size=(20, 3))]))


def few_cones(mesh: Mesh) -> Array:
    """Ten cones of a quarter turn and two of minus one on a sphere."""
    angles = np.full(len(mesh[0]), 2 * np.pi)
    chosen = np.random.default_rng(0).choice(len(angles), 12, replace=False)
    angles[chosen] -= np.pi / 2 * np.array([1] * 10 + [-1] * 2)
    return angles


def thin(options: Options) -> Iterator[tuple[Case, str]]:
    """Each case without refinement and with."""
    meshes = {f"prism {n}": prism(n) for n in (200, 2000, 8000)}
    meshes |= {f"clusters {size:g}": clusters(size) for size in (1e-2, 1e-4)}
    cases: list[Case] = []
    for name, mesh in meshes.items():
        cases += [(f"{name}, few", mesh, few_cones(mesh))]
        cases += [(f"{name}, random", mesh, every_angle(mesh, 0))]
    for seed in range(9):
        *mesh, angles = strip_of_needles(seed)
        cases += [(f"strip {seed}, random", (mesh[0], mesh[1]), angles)]
    for case in options.cases(cases, lambda case: case[0]):
        yield case, "off"
        yield case, "on"


@table("case | V | refined | added | steps | relaxed | bits | flips | range of u | error | CPU s")
def needles(options: Options) -> Iterator[Row]:
    for (name, mesh, target), mode in thin(options):
        m, seconds = solve(mesh, target, intrinsic_refinement=mode)
        if not m.converged:
            options.fail(f"{name}, {mode}: {m.angle_error}")
        head = name, len(mesh[0]), mode, m.stats["intrinsic_refinement"], m.iterations
        figures = m.stats["relaxed_iterations"], m.bits, m.flips, f"{m.scale_range:.1f}"
        yield *head, *figures, f"{m.angle_error:.1e}", f"{seconds:.2f}"


@table("surface | bound | ratio of largest to smallest scale | cones | CPU s")
def cones(options: Options) -> Iterator[Row]:
    for name in options.cases(("elephant", "fertility_tri", "aircraft", "gtorus003")):
        mesh = read_mesh(data() / "conformal" / f"{name}.obj")
        for bound in (4.0, 3.0, 2.0):
            with timed() as cost:
                s = ff.suggest_cones(mesh.vertices, mesh.faces, bound=bound, quarter_turns=True)
            yield name, f"{bound:g}", f"{s.scale_ratio:.2f}", len(s.cones), f"{cost.cpu:.1f}"


if __name__ == "__main__":
    main(__doc__, count=(100, "of random cases"), bits=(0, "of metrics; tolerance 1e-16 then"))
