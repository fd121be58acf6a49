"""ff.pack beside Blender's Pack Islands and xatlas: layouts of 5 to 10 000 islands, all judged.

    packing.py peers [--blender PROGRAM] [--effort 1] [--pixels 2] [--size 1024]

Layouts: real models whose faces are grown together from seeds that lie far apart, in as many patches as wanted, flattened by
ff.unwrap; and drawn shapes (tests/packing_layouts.py). All get the same islands and the gap of --pixels of --size. A cell: the
islands' area as a share of the square, the least gap on the stored values in those pixels (tests/judges/gaps.py), CPU seconds.
Blender has the fullest of up to a dozen presses that keeps the gap, and the time of that one alone. xatlas, left out where it cannot
be imported, has two columns: with its least padding, and with the least by which it keeps the gap. Exit status 1 if one of ours is
narrower than asked for, or fills less than what a peer makes that keeps the gap.
"""

from __future__ import annotations

import heapq
import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import numpy.typing as npt
from packing_layouts import Layout, drawn, flat
from runner import Options, Row, data, from_blender, main, table, timed

import flipfree as ff

from judges import gaps
from mesh_files import read_mesh

Array = npt.NDArray[np.float64]
Faces = npt.NDArray[np.int32]
Packed = tuple[Array, float]  # UVs as stored, CPU seconds
BLENDER_SECONDS = 60.0  # of CPU, for all presses

# Model of the shared data folder's seams/ and the patches it is cut into.
CUT_MODELS = (
    ("bunny", 5),
    ("hand1", 8),
    ("cow2", 10),
    ("planck1", 12),
    ("kingkong_f20000", 16),
    ("horse_f10000", 20),
    ("lucy_o_f8000", 25),
    ("venus", 32),
    ("chinese_lion_i_f10000", 40),
    ("camel_vova_f10000", 50),
    ("male_body_i_f10000", 64),
    ("santa_i_f10000", 80),
    ("buddha2_f10000", 100),
    ("dilo_o_f10000", 150),
    ("statue_5_i_f10000", 200),
    ("girl1", 300),
)
# Name, count and seed of layouts of drawn islands.
DRAWN = (
    ("blobs", 7, 1),
    ("letters", 30, 2),
    ("rings", 60, 3),
    ("mixed", 120, 4),
    ("mixed", 300, 5),
    ("sizes", 500, 6),
    ("blobs", 1000, 7),
    ("mixed", 3000, 8),
    ("mixed", 10000, 9),
)


def patches_of(vertices: Array, faces: Faces, count: int) -> npt.NDArray[np.int32]:
    """Faces grown together from seeds that lie far apart, over short ways and small turns."""
    corners = vertices[faces]
    centre = corners.mean(1)
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
    size = float(np.ptp(vertices, axis=0).max())
    beside: dict[tuple[int, int], list[int]] = {}
    for f, triangle in enumerate(faces.tolist()):
        for k in range(3):
            a, b = triangle[k], triangle[(k + 1) % 3]
            beside.setdefault((min(a, b), max(a, b)), []).append(f)
    ways: list[list[tuple[int, float]]] = [[] for _ in faces]
    for pair in beside.values():
        if len(pair) == 2:
            f, g = pair
            turn = 1.0 - float(normal[f] @ normal[g])
            length = float(np.linalg.norm(centre[f] - centre[g])) / size + 0.3 * turn
            ways[f].append((g, length))
            ways[g].append((f, length))
    distance = np.full(len(faces), np.inf)
    owner = np.zeros(len(faces), np.int32)
    seed = 0
    for patch in range(count):
        heap = [(0.0, seed)]
        distance[seed] = 0.0
        owner[seed] = patch
        while heap:
            d, f = heapq.heappop(heap)
            if d > distance[f] or owner[f] != patch:
                continue
            for g, length in ways[f]:
                if d + length < distance[g]:
                    distance[g] = d + length
                    owner[g] = patch
                    heapq.heappush(heap, (d + length, g))
        seed = int(np.argmax(distance))
    return owner


def cut_model(model: str, count: int) -> Layout:
    mesh = read_mesh(data() / "seams" / f"{model}.obj")
    vertices, faces = mesh.vertices, mesh.faces
    owner = patches_of(vertices, faces, count)
    first: dict[tuple[int, int], int] = {}
    cuts = []
    for f, triangle in enumerate(faces.tolist()):
        for k in range(3):
            a, b = triangle[k], triangle[(k + 1) % 3]
            edge = (min(a, b), max(a, b))
            other = first.setdefault(edge, f)
            if owner[other] != owner[f]:
                cuts.append(edge)
    found = ff.unwrap(vertices, faces, cuts=np.array(cuts, np.int32), seams="given")
    return flat(found.uv)


def area(uv: Array) -> float:
    a, b = uv[:, 1] - uv[:, 0], uv[:, 2] - uv[:, 0]
    return float(np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum() / 2)


def narrowest(layout: Layout, uv: Array, gap: float) -> float:
    order = np.argsort(layout.island, kind="stable")
    ends = np.searchsorted(layout.island[order], np.arange(1, layout.islands))
    return gaps.narrowest(np.split(uv[order], ends), 2.5 * gap).distance


def ours(layout: Layout, gap: float, effort: float) -> Packed:
    how = {"margin": gap, "effort": effort, "rotation": "free"}
    with timed() as cost:
        packed = ff.pack(layout.vertices, layout.faces, layout.uv, **how)
    return packed.uv32().astype(np.float64), cost.cpu


def by_blender(layout: Layout, gap: float, program: str) -> Packed | None:
    """None if no press keeps the gap on the stored values."""
    with tempfile.TemporaryDirectory() as folder:
        source = Path(folder) / "in.npz"
        np.savez(source, vertices=layout.vertices, faces=layout.faces, uv=layout.uv)
        found = from_blender(program, "pack", source, gap, BLENDER_SECONDS)
    presses, seconds = found["uv"].astype(np.float64), found["seconds"]
    for at in sorted(range(len(presses)), key=lambda k: -area(presses[k])):
        if narrowest(layout, presses[at], gap) >= gap:
            return presses[at], seconds[at][1]
    return None


def by_xatlas(layout: Layout, padding: int, size: int) -> Packed:
    """In units of the smallest square around. With padding 0 islands are about 2.2 of its own pixels apart, of which it makes up
    to 1300 where 1024 are asked for."""
    import xatlas

    atlas = xatlas.Atlas()
    corners = (layout.vertices[:, :2] / np.sqrt(area(layout.uv))).astype(np.float32)
    atlas.add_uv_mesh(corners, layout.faces.astype(np.uint32))
    options = xatlas.PackOptions()
    options.padding = padding
    options.resolution = size
    options.bruteForce = layout.islands <= 1000
    with timed() as cost:
        atlas.generate(pack_options=options)
    _, indices, uv = atlas.get_mesh(0)
    pixels = uv[indices.reshape(-1, 3)].astype(np.float64) * [atlas.width, atlas.height]
    return pixels / float(max(atlas.width, atlas.height)), cost.cpu


def xatlas_keeping(layout: Layout, gap: float, size: int) -> Packed | None:
    """With the least padding whose gap is as wide as asked for on the stored values; None if up to 8 pixels there is none."""
    for padding in (0, 1, 2, 4, 8):
        found = by_xatlas(layout, padding, size)
        if narrowest(layout, found[0], gap) >= gap:
            return found
    return None


@table("layout | islands | ours: fill, gap, CPU s | Blender | xatlas | xatlas, keeping the gap")
def peers(options: Options) -> Iterator[Row]:
    gap = options.pixels / options.size
    try:
        import xatlas as _  # noqa: F401

        with_xatlas = True
    except ImportError:
        with_xatlas = False
    fills: list[list[float]] = [[], [], [], []]
    for name in options.cases([*CUT_MODELS, *DRAWN], lambda case: f"{case[0]}/{case[1]}"):
        layout = cut_model(*name) if len(name) == 2 else drawn(*name)
        found: list[Packed | None] = [ours(layout, gap, options.effort), None, None, None]
        if options.blender:
            found[1] = by_blender(layout, gap, options.blender)
        if with_xatlas:
            found[2] = by_xatlas(layout, max(0, round(options.pixels) - 2), options.size)
            found[3] = xatlas_keeping(layout, gap, options.size)
        cells = []
        for packed, own in zip(found, fills, strict=True):
            if packed is None:
                cells.append("")
                continue
            least, fill = narrowest(layout, packed[0], gap), area(packed[0])
            own.append(fill)
            wrong = least < gap if own is fills[0] else least >= gap and fill >= fills[0][-1]
            if wrong:
                options.fail(f"{name}: fill {fill}, gap {least}")
            cells.append(f"{fill:.3f}, {least * options.size:.2f}, {packed[1]:.2f}")
        yield f"{name[0]}/{name[1]}", layout.islands, *cells
    yield "mean", "", *[f"{np.mean(values):.3f}" if values else "" for values in fills]


if __name__ == "__main__":
    main(__doc__, effort=(1.0, ""), pixels=(2.0, ""), size=(1024, ""))
