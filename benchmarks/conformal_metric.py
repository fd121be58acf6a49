"""Measures ff.conformal_metric: the thesis' experiments 4.6.1 and 4.6.3, the shared pairs, speed.

    PYTHONPATH=build/python python3 benchmarks/conformal_metric.py pairs|sphere|disk|bits|gtori|places|speed
        [--count N] [--plot docs/images] [--only TEXT] [--seconds S]

Seeds are fixed. Times are user CPU seconds of the whole process, all threads, so that a busy machine disturbs them
less. Exit status 1 if a case misses its tolerance. `--plot` needs matplotlib, `sphere`, `disk`, `bits`, `speed` scipy.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from conformal_maps import cases

import flipfree as ff
from flipfree.results import FLIP_TYPES

from mesh_files import data_folder, read_mesh

Mesh = tuple[npt.NDArray[np.float64], npt.NDArray[np.int32]]

# Public code of the thesis' authors on the same pairs: seconds for the metric, from the data folder's README.
REFERENCE = {
    "aircraft": 0.07, "fertility_tri": 0.75, "elephant": 0.65, "1146164_cut": 0.08, "cup_input_simple_10000_cut": 0.39,
    "fertility_input_cut": 0.29, "gtorus006_singlecone": 115.0,
}  # fmt: skip


def sphere(count: int, seed: int) -> Mesh:
    """Fibonacci points, jittered by a third of their spacing; hull."""
    from scipy.spatial import ConvexHull

    i = np.arange(count) + 0.5
    z, a = 1 - 2 * i / count, np.pi * (1 + np.sqrt(5)) * i
    points = np.stack([np.sqrt(1 - z * z) * np.cos(a), np.sqrt(1 - z * z) * np.sin(a), z], axis=1)
    points += np.random.default_rng(seed).normal(
        scale=0.33 * np.sqrt(4 * np.pi / count) / 2, size=points.shape
    )
    points /= np.linalg.norm(points, axis=1)[:, None]
    faces = ConvexHull(points).simplices.astype(np.int32)
    p = points[faces]
    inward = np.einsum("ij,ij->i", np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]), p.sum(1)) < 0
    faces[inward] = faces[inward][:, ::-1]
    return points, faces


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


def g_torus(genus: int, hole: int = 3, wall: int = 2, smoothing: int = 2) -> Mesh:
    """A plate with `genus` square holes in rows, as the shared gtorusNNN: voxels, thickness `wall`, corners smoothed."""
    columns = int(np.ceil(np.sqrt(genus))) if genus > 6 else genus
    rows = -(-genus // columns)
    period = hole + wall
    filled = np.ones((period * columns + wall, period * rows + wall, wall), bool)
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


def boundary_vertices(faces: npt.NDArray[np.int32]) -> npt.NDArray[np.intp]:
    half = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
    edges, uses = np.unique(half, axis=0, return_counts=True)
    return np.unique(edges[uses == 1])


def interior_targets(mesh: Mesh, random: np.random.Generator) -> npt.NDArray[np.float64]:
    """Every vertex in (pi, 3 pi), thesis 4.6.1; shifted to meet Gauss-Bonnet."""
    target = random.uniform(np.pi, 3 * np.pi, len(mesh[0]))
    return target + (np.pi * len(mesh[1]) - target.sum()) / len(target)


def boundary_targets(
    mesh: Mesh, spread: float, random: np.random.Generator
) -> npt.NDArray[np.float64]:
    """Flat inside; geodesic curvature within +-spread on the boundary, all angles > 0.01."""
    rim = boundary_vertices(mesh[1])
    target = np.full(len(mesh[0]), 2 * np.pi)
    while True:
        kappa = random.uniform(-spread, spread, len(rim))
        kappa += (2 * np.pi - kappa.sum()) / len(kappa)
        if (np.pi - kappa).min() > 0.01:
            target[rim] = np.pi - kappa
            return target


def solve(mesh: Mesh, target: Any, **options: Any) -> tuple[ff.ConformalMetric, float]:
    start = time.process_time()
    metric = ff.conformal_metric(*mesh, target, require_convergence=False, **options)
    return metric, time.process_time() - start


def row(*cells: Any) -> None:
    print("| " + " | ".join(str(c) for c in cells) + " |", flush=True)


def heading(*cells: str) -> None:
    row(*cells)
    row(*["---"] * len(cells))


def figure(size: tuple[float, float]) -> Any:
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    return plt.subplots(figsize=size, layout="constrained")


def run_pairs(arguments: argparse.Namespace) -> bool:
    folder = data_folder()
    if folder is None:
        sys.exit("The shared data folder is not here (FLIPFREE_DATA).")
    heading(
        "case",
        "V",
        "steps",
        "bits",
        "error",
        "range of u",
        "flips",
        "relaxed",
        "CPU s",
        "reference s",
    )
    good = True
    for name, path, angles in cases(folder / "conformal"):
        if arguments.only not in name:
            continue
        file = read_mesh(path)
        m, seconds = solve(
            (file.vertices, file.faces), np.loadtxt(angles), max_seconds=arguments.seconds
        )
        good &= m.converged and m.angle_error <= 1e-10
        row(name, len(file.vertices), m.iterations, m.bits, f"{m.angle_error:.1e}", f"{m.scale_range:.1f}", m.flips,
            m.stats["relaxed_iterations"], f"{seconds:.3f}", REFERENCE.get(name, ""))  # fmt: skip
    return good


def many(meshes: Any, count: int, label: str) -> tuple[list[ff.ConformalMetric], list[float]]:
    metrics, seconds = [], []
    for i in range(count):
        mesh, target = meshes(i)
        m, s = solve(mesh, target)
        metrics.append(m)
        seconds.append(s)
    errors = np.array([m.angle_error for m in metrics])
    steps = [m.iterations for m in metrics]
    print(
        f"{label}: {count} cases, {np.sum(errors <= 1e-10)} within 1e-10, worst {errors.max():.1e}"
    )
    print(f"Newton steps {min(steps)} to {max(steps)}, mean {np.mean(steps):.1f}; CPU s mean {np.mean(seconds):.3f}, max "
          f"{max(seconds):.3f}; bits {dict(Counter(m.bits for m in metrics))}")  # fmt: skip
    print("steps:", " ".join(f"{k}:{v}" for k, v in sorted(Counter(steps).items())))
    return metrics, seconds


def plot_steps(metrics: list[ff.ConformalMetric], path: Path, title: str) -> None:
    fig, ax = figure((6, 3))
    steps = [m.iterations for m in metrics]
    ax.hist(
        steps,
        bins=np.arange(min(steps) - 0.5, max(steps) + 1.5),
        color="#3b6ea5",
        edgecolor="white",
    )
    ax.set_xlabel("Newton steps to 1e-10")
    ax.set_ylabel("cases")
    ax.set_title(title)
    fig.savefig(path, dpi=110)


def run_sphere(arguments: argparse.Namespace) -> bool:
    mesh = sphere(1000, 0)
    metrics, _ = many(
        lambda i: (mesh, interior_targets(mesh, np.random.default_rng(i))),
        arguments.count,
        "1K sphere",
    )
    if arguments.plot:
        plot_steps(
            metrics,
            arguments.plot / "conformal_steps_sphere.png",
            "Random angles on a sphere of 1000 vertices",
        )
        fig, ax = figure((6, 3.4))
        for m in metrics[:200]:
            ax.semilogy(
                np.maximum(m.error_history, 1e-15), color="#3b6ea5", alpha=0.12, linewidth=1
            )
        ax.set_xlabel("Newton step")
        ax.set_ylabel("largest angle error")
        ax.set_title("Decay of the error, 200 of the cases")
        fig.savefig(arguments.plot / "conformal_decay_sphere.png", dpi=110)
    return all(m.angle_error <= 1e-10 for m in metrics)


def run_disk(arguments: argparse.Namespace) -> bool:
    mesh = disk(40)
    spreads = np.random.default_rng(99).uniform(0.05, 0.95, arguments.count)
    metrics, _ = many(
        lambda i: (mesh, boundary_targets(mesh, np.pi * spreads[i], np.random.default_rng(i))),
        arguments.count,
        "5K disk",
    )
    heading("spread of boundary curvature / pi", *FLIP_TYPES)
    for low in np.arange(0.05, 0.95, 0.15):
        chosen = [
            m.flip_counts for m, s in zip(metrics, spreads, strict=True) if low <= s < low + 0.15
        ]
        if chosen:
            row(f"{low:.2f} - {low + 0.15:.2f}", *[f"{x:.1f}" for x in np.mean(chosen, axis=0)])
    if arguments.plot:
        plot_steps(
            metrics,
            arguments.plot / "conformal_steps_disk.png",
            "Random boundary curvature on a disk of 4921 vertices",
        )
        fig, ax = figure((6.5, 4))
        counts = np.array([m.flip_counts for m in metrics])
        for t, name in enumerate(FLIP_TYPES):
            ax.scatter(spreads, counts[:, t] + 0.5, s=5, label=name, alpha=0.6)
        ax.set_yscale("log")
        ax.set_xlabel("spread of the boundary curvature / pi")
        ax.set_ylabel("flips + 1/2")
        ax.legend(fontsize=8, ncols=2)
        ax.set_title("Symmetric flips by type")
        fig.savefig(arguments.plot / "conformal_flip_types.png", dpi=110)
    return all(m.angle_error <= 1e-10 for m in metrics)


def run_bits(arguments: argparse.Namespace) -> bool:
    """Thesis 4.6.3: the error that each precision reaches in at most 50 steps, against the range of u."""
    mesh = sphere(1000, 0)
    mantissas = (53, 75, 100, 125, 150)
    points: dict[int, list[tuple[float, float]]] = {b: [] for b in mantissas}
    for i in range(arguments.count):
        target = interior_targets(mesh, np.random.default_rng(i))
        for b in mantissas:
            m, _ = solve(mesh, target, precision=b, tolerance=2.0 ** (-b - 20), iterations=50)
            points[b].append((m.scale_range, m.angle_error))
    heading("bits", "median error", "worst error", "units of the last place (median)")
    for b in mantissas:
        errors = np.array([e for _, e in points[b]])
        row(
            b,
            f"{np.median(errors):.1e}",
            f"{errors.max():.1e}",
            f"{np.median(errors) * 2.0**b:.0f}",
        )
    if arguments.plot:
        fig, ax = figure((6, 4))
        for b in mantissas:
            ax.scatter(*zip(*points[b], strict=True), s=7, label=f"{b} bits")
        ax.set_yscale("log")
        ax.set_xlabel("range of u")
        ax.set_ylabel("largest angle error reached")
        ax.legend()
        ax.set_title("Error against mantissa bits")
        fig.savefig(arguments.plot / "conformal_bits.png", dpi=110)
    worst = [max(e for _, e in points[b]) for b in mantissas]
    return all(a > b for a, b in zip(worst, worst[1:], strict=False))


def run_gtori(arguments: argparse.Namespace) -> bool:
    """A single cone of 2 pi (2 g - 1) on surfaces of genus g, tolerance 1e-25 (thesis Figure 4.11).

    200 bits; where these end above the tolerance, precision "auto", and the time of both."""
    problems = []
    for genus in (3, 6, 10, 15, 22, 30, 40, 50, 60, 70, 80, 100, 150):
        mesh = g_torus(genus)
        target = np.full(len(mesh[0]), 2 * np.pi)
        target[-1] = 2 * np.pi * (2 * genus - 1)
        problems.append((f"{genus} holes", mesh, target))
    folder = data_folder()
    for name, path, angles in cases(folder / "conformal") if folder else []:
        if name.startswith("gtorus") and name.endswith("singlecone"):
            file = read_mesh(path)
            problems.append((name, (file.vertices, file.faces), np.loadtxt(angles)))
    heading("case", "V", "steps", "bits", "error", "range of u", "flips", "CPU s")
    good = True
    points = []
    for name, mesh, target in problems:
        if arguments.only not in name:
            continue
        m, seconds = solve(
            mesh, target, precision=200, tolerance=1e-25, max_seconds=arguments.seconds
        )
        if m.stats["stopped_by"] == "precision":
            m, more = solve(mesh, target, tolerance=1e-25, max_seconds=arguments.seconds)
            seconds += more
        good &= m.angle_error <= 1e-25
        row(name, len(mesh[0]), m.iterations, m.bits, f"{m.angle_error:.1e}", f"{m.scale_range:.1f}", m.flips,
            f"{seconds:.2f}")  # fmt: skip
        if name.endswith("holes"):
            points.append((int(name.split()[0]), m.iterations, seconds, m.angle_error <= 1e-25))
    if arguments.plot and points:
        fig, axes = figure((6, 3.6))
        genus, steps, seconds, reached = (np.array(x) for x in zip(*points, strict=True))
        axes.plot(genus[reached], steps[reached], "o-", color="#3b6ea5", label="Newton steps")
        axes.plot(genus[~reached], steps[~reached], "x", color="#b03030", label="not reached")
        axes.set_xlabel("genus")
        axes.set_ylabel("Newton steps")
        other = axes.twinx()
        other.plot(genus[reached], seconds[reached], "s--", color="#c08030", label="CPU seconds")
        other.set_ylabel("CPU seconds")
        fig.legend(loc="upper left", bbox_to_anchor=(0.12, 0.95))
        axes.set_title("All curvature in one cone, error below 1e-25 with 200 bits")
        fig.savefig(arguments.plot / "conformal_gtori.png", dpi=110)
    return good


def run_places(arguments: argparse.Namespace) -> bool:
    """The single cone at three places of plates with holes; what is reached in a limited time in the default precision."""
    heading("case", "V", "steps", "bits", "error", "stopped by", "CPU s")
    good = True
    for genus in (25, 30, 36, 42, 50):
        mesh = g_torus(genus, smoothing=0)
        for place in (0, len(mesh[0]) // 2, len(mesh[0]) - 1):
            name = f"{genus} holes, cone at {place}"
            if arguments.only not in name:
                continue
            target = np.full(len(mesh[0]), 2 * np.pi)
            target[place] = 2 * np.pi * (2 * genus - 1)
            m, seconds = solve(mesh, target, max_seconds=arguments.seconds)
            good &= m.angle_error <= 1e-10
            row(name, len(mesh[0]), m.iterations, m.bits, f"{m.angle_error:.1e}",
                m.stats["stopped_by"], f"{seconds:.2f}")  # fmt: skip
    return good


def run_speed(arguments: argparse.Namespace) -> bool:
    for size in (1000, 10000):
        mesh = sphere(size, 0)
        wall = time.perf_counter()
        metrics, _ = many(
            lambda i, mesh=mesh: (mesh, interior_targets(mesh, np.random.default_rng(i))),
            arguments.count,
            f"sphere {size}",
        )
        print(f"wall s mean {(time.perf_counter() - wall) / arguments.count:.3f}")
    mesh = sphere(50000, 0)
    target = np.full(len(mesh[0]), 2 * np.pi)
    cones = np.random.default_rng(0).choice(len(target), 40, replace=False)
    target[cones[:24]] -= np.pi / 2
    target[cones[24:]] += np.pi / 2
    m, seconds = solve(mesh, target)
    print(f"100k triangles, 40 quarter-turn cones: {m.iterations} steps, error {m.angle_error:.1e}, CPU s {seconds:.2f}, "
          f"wall s {m.stats['seconds']:.2f}")  # fmt: skip
    return m.angle_error <= 1e-10 and all(x.angle_error <= 1e-10 for x in metrics)


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    runs = {"pairs": run_pairs, "sphere": run_sphere, "disk": run_disk, "bits": run_bits, "gtori": run_gtori,
            "places": run_places, "speed": run_speed}  # fmt: skip
    parser.add_argument("experiment", choices=runs)
    parser.add_argument("--count", type=int, default=100)
    parser.add_argument("--plot", type=Path)
    parser.add_argument("--only", default="")
    parser.add_argument("--seconds", type=float, default=300.0, help="give a case up after so long")
    arguments = parser.parse_args()
    return 0 if runs[arguments.experiment](arguments) else 1


if __name__ == "__main__":
    sys.exit(main())
