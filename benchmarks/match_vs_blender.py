"""Match Pins and every method of Blender's own unwrap, side by side in one run, on the same island with the same moved pins.

    PYTHONPATH=build/python python3 benchmarks/match_vs_blender.py --blender build/blender-4.3/blender [--level 3]
        [--seeds 1 2 3] [--shares 0.02 0.2] [--pictures FOLDER]

The largest island of a subdivided monkey (level 3: 63k triangles in 5 islands), six random inner vertices moved from Blender's own
layout by a share of the unit square. Flips, overlaps and energy of both sides are measured by ff.certify on the stored 32-bit values;
the pin error is the largest distance between a stored UV and its pin. Blender runs as a process of its own; only the operator, on
the selected island, is timed there, the whole call here. --pictures wants matplotlib (build/venv has it).
"""

from __future__ import annotations

import argparse
import subprocess
import tempfile
from pathlib import Path

import numpy as np

import flipfree as ff

from cost import timed
from mesh_files import cut_corners
from random_pins import pinned

WORKER = Path(__file__).resolve().parent / "blender_match_worker.py"
OURS = {"Flipfree UV": True, "Flipfree UV, overlaps allowed": False}


def chart_of(data: dict[str, np.ndarray]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(vertices, faces, vertex of Blender's mesh) of the island as a disk of its own, cut along its seams."""
    faces = data["faces"]
    corner, _ = cut_corners(faces, data["seams"])
    first, chart_faces = np.unique(corner, return_inverse=True)
    origin = faces.ravel()[first]
    return data["vertices"][origin], chart_faces.reshape(-1, 3).astype(np.int32), origin


def pin_error(uv: np.ndarray, faces: np.ndarray, points: dict[int, tuple[float, float]]) -> float:
    """Largest distance between a stored corner of a pinned vertex and its pin."""
    return max(
        float(np.abs(uv[faces == vertex].astype(np.float64) - np.array(target)).max())
        for vertex, target in points.items()
    )


def row(
    share: str,
    seed: str,
    name: str,
    c: ff.Certificate,
    error: float,
    wall: float,
    cpu: float,
    more: str,
) -> None:
    print(
        f"| {share} | {seed} | {name} | {c.flips32} | {c.overlaps} | {error:.2g} | {c.energy:.4f} | {c.max_energy:.3g} "
        f"| {wall:.2f} | {cpu:.2f} | {more} |",
        flush=True,
    )


def picture(
    path: Path, maps: dict[str, tuple[np.ndarray, np.ndarray]], points, start: dict, title: str
) -> None:
    """All maps beside each other in one frame: islands grey, flipped triangles red, pins blue, their way as lines; below, the
    surrounding of the pin where most of Blender's flips are."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
    from matplotlib.collections import PolyCollection

    def areas(uv):
        a, b, c = (uv[:, k].astype(np.float64) for k in range(3))
        return (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])

    targets = np.array(list(points.values()))
    folded = np.concatenate([uv[areas(uv) <= 0].reshape(-1, 2) for uv, _ in maps.values()])
    near = (
        (np.linalg.norm(folded[:, None] - targets[None], axis=2) < 0.04).sum(0)
        if len(folded)
        else [1]
    )
    centre = targets[int(np.argmax(near))]
    figure, axes = plt.subplots(2, len(maps), figsize=(3.1 * len(maps), 6.6), dpi=110)
    everything = np.concatenate([uv.reshape(-1, 2) for uv, _ in maps.values()])
    low, high = everything.min(0) - 0.02, everything.max(0) + 0.02
    for column, (name, (uv, _)) in enumerate(maps.items()):
        flipped = areas(uv) <= 0
        for line, (left, right) in enumerate(((low, high), (centre - 0.045, centre + 0.045))):
            ax = axes[line, column]
            seen = ((uv.max(1) > left) & (uv.min(1) < right)).all(1)
            ax.add_collection(
                PolyCollection(
                    uv[seen & ~flipped],
                    facecolor="#e4e4e4",
                    edgecolor="#9a9a9a",
                    linewidth=0.05 + 0.25 * line,
                )
            )
            ax.add_collection(
                PolyCollection(
                    uv[seen & flipped],
                    facecolor="#e0202080",
                    edgecolor="#d01010",
                    linewidth=1.2 - 0.6 * line,
                )
            )
            for vertex, target in points.items():
                ax.plot(*zip(start[vertex], target, strict=True), color="#3060d0", linewidth=0.8)
            ax.plot(targets[:, 0], targets[:, 1], "s", color="#1030c0", markersize=4)
            ax.set_xlim(left[0], right[0])
            ax.set_ylim(left[1], right[1])
            ax.set_aspect("equal")
            ax.set_xticks([])
            ax.set_yticks([])
        axes[0, column].set_title(f"{name}\n{int(flipped.sum())} flips", fontsize=9)
    figure.suptitle(title, fontsize=9)
    figure.tight_layout()
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path)
    plt.close(figure)


def blender_data(arguments: argparse.Namespace) -> dict[str, np.ndarray]:
    """What blender_match_worker.py stores: the island, and for every case the pins and Blender's own maps."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "pins.npz"
        subprocess.run(
            [
                str(arguments.blender.resolve()), "-b", "--factory-startup", "--python-exit-code", "1",
                "--python", str(WORKER), "--", str(arguments.level), str(out),
                ",".join(arguments.seeds), ",".join(arguments.shares),
            ],
            check=True,
            stdout=subprocess.DEVNULL,
        )  # fmt: skip
        return dict(np.load(out))


def compare(
    data: dict[str, np.ndarray],
    chart: tuple[np.ndarray, np.ndarray, np.ndarray],
    share: str,
    seed: str,
) -> tuple[dict[str, tuple[np.ndarray, np.ndarray]], dict[int, tuple[float, float]]]:
    """One case, a line per method. Returns the maps (uv, faces) by name, and the pins."""
    vertices, faces, origin = chart
    case = f"{share}_{seed}"
    chart_vertex = {int(v): i for i, v in enumerate(origin.tolist())}
    pins = [chart_vertex[int(v)] for v in data[f"{case}_pins"]]
    points = pinned(np.array(pins), data[f"{case}_targets"].astype(np.float64))
    maps = {}
    for name in data["methods"].tolist():
        uv = data[f"{case}_{name}_uv"]
        certificate = ff.certify(vertices, faces, uv, bijective=True)
        error = pin_error(uv, faces, points)
        row(share, seed, f"Blender {name}", certificate, error, *data[f"{case}_{name}_seconds"], "")
        maps[f"Blender, {name}"] = (uv, faces)
    for name, bijective in OURS.items():
        try:
            with timed() as cost:
                result = ff.match(vertices, faces, points=points, bijective=bijective)
        except ff.FlipfreeError as error:
            print(f"| {share} | {seed} | {name} | {type(error).__name__}: {error} |", flush=True)
            continue
        stored = ff.certify(result.vertices, result.faces, result.uv32(), bijective=True)
        error = pin_error(result.uv32(), result.faces, points)
        added = f"{len(result.vertices) - len(vertices)} vertices added"
        row(share, seed, name, stored, error, cost.wall, cost.cpu, added)
        if bijective:
            maps[name] = (result.uv32(), result.faces)
    return maps, points


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--blender", required=True, type=Path)
    parser.add_argument("--level", type=int, default=3)
    parser.add_argument("--seeds", nargs="+", default=["1", "2", "3"])
    parser.add_argument("--shares", nargs="+", default=["0.02", "0.2"])
    parser.add_argument("--pictures", type=Path, default=None)
    arguments = parser.parse_args()
    data = blender_data(arguments)
    chart = chart_of(data)
    vertices, faces, _ = chart
    print(f"{len(faces)} triangles, {len(vertices)} vertices in the island")
    print(
        "| moved by | seed | method | flips | overlaps | pin error | energy | worst triangle | wall s | cpu s | |"
    )
    print("|---|---|---|---|---|---|---|---|---|---|---|")
    for share in arguments.shares:
        for seed in arguments.seeds:
            maps, points = compare(data, chart, share, seed)
            if arguments.pictures is None:
                continue
            start = {v: data["layout"][faces == v][0] for v in points}
            title = (
                f"{len(faces)} triangles, six pins moved by {share} of the unit square, seed {seed}"
            )
            path = arguments.pictures / f"match_vs_blender_{share}_{seed}.png"
            picture(path, maps, points, start, title)


if __name__ == "__main__":
    main()
