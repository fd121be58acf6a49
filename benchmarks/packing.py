"""Packs layouts of 5 to 10 000 islands (packing_layouts.py) beside Blender's Pack Islands and xatlas, and judges all of them.

    PYTHONPATH=build/python:XATLAS python3 benchmarks/packing.py [--blender build/blender-5.2/blender] [--effort E] [--pixels P]
        [--size S] [--pictures DIR] [--cache DIR] [NAME ...]

XATLAS: a folder with xatlas from PyPI; left out if it is not there. All get the same islands and the gap of P pixels of S. Fill: the
islands' area as a share of the square. Gaps are measured on the stored values by
tests/judges/gaps.py. Blender has the fullest of up to a dozen presses that keeps the gap (blender_pack_worker.py), and the time of
that one alone. xatlas has two columns: with its least padding, and with the least by which it keeps the gap. Exit status 1 if one
of ours overlaps, is narrower than asked for, or fills less than what a peer makes that keeps the gap.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

import flipfree as ff

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "tests"))

from packing_layouts import Layout, layouts  # noqa: E402

from judges import gaps  # noqa: E402

Array = npt.NDArray[np.float64]
WORKER = Path(__file__).resolve().parent / "blender_pack_worker.py"

BLENDER_SECONDS = 60.0  # of CPU, for all presses


def area(uv: Array) -> float:
    a, b = uv[:, 1] - uv[:, 0], uv[:, 2] - uv[:, 0]
    return float(np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum() / 2)


def islands_of(layout: Layout, uv: Array) -> list[Array]:
    order = np.argsort(layout.island, kind="stable")
    return np.split(uv[order], np.searchsorted(layout.island[order], np.arange(1, layout.islands)))


def ours(layout: Layout, gap: float, effort: float) -> tuple[Array, float, float]:
    wall, cpu = time.perf_counter(), time.process_time()
    packed = ff.pack(
        layout.vertices, layout.faces, layout.uv, margin=gap, effort=effort, rotation="free"
    )
    seconds = time.perf_counter() - wall, time.process_time() - cpu
    return packed.uv32().astype(np.float64), *seconds


def blender(layout: Layout, gap: float, program: str) -> tuple[Array, float, float] | None:
    """None if no press keeps the gap on the stored values."""
    with tempfile.TemporaryDirectory() as folder:
        source, out = Path(folder) / "in.npz", Path(folder) / "out.npz"
        np.savez(source, vertices=layout.vertices, faces=layout.faces, uv=layout.uv)
        command = [
            program,
            "-b",
            "--factory-startup",
            "--python-exit-code",
            "1",
            "--python",
            WORKER,
        ]
        subprocess.run(
            [*map(str, command), "--", str(source), str(out), repr(gap), str(BLENDER_SECONDS)],
            check=True,
            capture_output=True,
        )
        found = np.load(out)
        presses, seconds = found["uv"].astype(np.float64), found["seconds"].tolist()
    for at in sorted(range(len(presses)), key=lambda k: -area(presses[k])):
        if gaps.narrowest(islands_of(layout, presses[at]), 2.5 * gap).distance >= gap:
            return presses[at], *seconds[at]
    return None


def xatlas(layout: Layout, padding: int, size: int) -> tuple[Array, float, float]:
    """In units of the smallest square around. With padding 0 islands are about 2.2 of its own pixels apart, of which it makes up
    to 1300 where 1024 are asked for."""
    import xatlas as peer

    atlas = peer.Atlas()
    corners = (layout.vertices[:, :2] / np.sqrt(area(layout.uv))).astype(np.float32)
    atlas.add_uv_mesh(corners, layout.faces.astype(np.uint32))
    options = peer.PackOptions()
    options.padding = padding
    options.resolution = size
    options.bruteForce = layout.islands <= 1000
    wall, cpu = time.perf_counter(), time.process_time()
    atlas.generate(pack_options=options)
    seconds = time.perf_counter() - wall, time.process_time() - cpu
    _, indices, uv = atlas.get_mesh(0)
    pixel_uv = uv[indices.reshape(-1, 3)].astype(np.float64) * [atlas.width, atlas.height]
    return pixel_uv / float(max(atlas.width, atlas.height)), *seconds


def xatlas_keeping(layout: Layout, gap: float, size: int) -> tuple[Array, float, float] | None:
    """With the least padding whose gap is as wide as asked for on the stored values; None if up to 8 pixels there is none."""
    for padding in (0, 1, 2, 4, 8):
        found = xatlas(layout, padding, size)
        if gaps.narrowest(islands_of(layout, found[0]), 2.5 * gap).distance >= gap:
            return found
    return None


def picture(layout: Layout, maps: dict[str, Array], path: Path) -> None:
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot
    from matplotlib.collections import PolyCollection

    figure, axes = pyplot.subplots(1, len(maps), figsize=(5 * len(maps), 5.3), dpi=100)
    colours = pyplot.get_cmap("tab20")(np.arange(layout.islands) * 7 % 20)[layout.island]
    for one, (name, uv) in zip(np.atleast_1d(axes), maps.items(), strict=True):
        one.add_collection(PolyCollection(list(uv), facecolors=colours, edgecolors="none"))
        one.set(xlim=(0, 1), ylim=(0, 1), aspect="equal", xticks=[], yticks=[])
        one.set_title(f"{name}: {area(uv):.3f}")
    figure.tight_layout()
    figure.savefig(path)
    pyplot.close(figure)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*")
    parser.add_argument("--blender")
    parser.add_argument("--effort", type=float, default=1.0)
    parser.add_argument("--pixels", type=float, default=2.0)
    parser.add_argument("--size", type=int, default=1024)
    parser.add_argument("--pictures", type=Path)
    arguments = parser.parse_args()
    gap = arguments.pixels / arguments.size
    fills: dict[str, list[float]] = {}
    wrong = 0
    try:
        import xatlas as _  # noqa: F401

        with_xatlas = True
    except ImportError:
        with_xatlas = False
    print(
        "| layout | islands | fill, gap in pixels, CPU s (clock): ours | Blender | xatlas | xatlas keeping the gap |"
    )
    print("|---|---|---|---|---|---|")
    for name, layout in layouts(set(arguments.names) or None):
        found: dict[str, Any] = {"ours": ours(layout, gap, arguments.effort)}
        if arguments.blender:
            found["Blender"] = blender(layout, gap, arguments.blender)
        if with_xatlas:
            found["xatlas"] = xatlas(layout, max(0, round(arguments.pixels) - 2), arguments.size)
            found["xatlas keeping it"] = xatlas_keeping(layout, gap, arguments.size)
        cells = []
        for who, packed in found.items():
            if packed is None:
                cells.append("none")
                continue
            uv, wall, cpu = packed
            least = gaps.narrowest(islands_of(layout, uv), 2.5 * gap).distance
            if who == "ours" and not least >= gap:
                wrong += 1
            if who != "ours" and least >= gap and area(uv) >= area(found["ours"][0]):
                wrong += 1
            fills.setdefault(who, []).append(area(uv))
            cells.append(f"{area(uv):.3f}, {least * arguments.size:.2f}, {cpu:.2f} ({wall:.2f})")
        print(f"| {name} | {layout.islands} | {' | '.join(cells)} |", flush=True)
        if arguments.pictures:
            path = arguments.pictures / f"{name.replace('/', '-')}.png"
            picture(layout, {who: made[0] for who, made in found.items() if made}, path)
    means = " | ".join(f"{who} {np.mean(values):.3f}" for who, values in fills.items())
    print(f"| mean | | {means} |")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
