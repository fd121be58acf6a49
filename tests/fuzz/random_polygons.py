"""Files of random planar polygons: concave ones, with windows and bridges, with corners in one place, in all formats.

    for name, content in files(range(500)): ...

A file holds one flat sheet of polygons that share their sides, or polygons apart from each other, all somewhere in space;
so its map is isometric. OBJ and PLY files also have what else files have: normals, colours, groups, materials, comments,
other elements.
"""

from __future__ import annotations

import math
import random
import struct
from collections.abc import Iterable, Iterator

Flat = tuple[float, float]
Outline = list[Flat]

ENDINGS = ("obj", "ply", "obj", "ply", "off", "stl")


def star(chance: random.Random) -> Outline:
    count = chance.randint(5, 24)
    turns = [2 * math.pi * (k + chance.uniform(0.0, 0.6)) / count for k in range(count)]
    sizes = [chance.uniform(0.25, 1.0) for _ in turns]
    return [(r * math.cos(t), r * math.sin(t)) for r, t in zip(sizes, turns, strict=True)]


def comb(chance: random.Random) -> Outline:
    """With one gap it is a U."""
    gaps = chance.randint(1, 5)
    points: Outline = [(0.0, 0.0), (2.0 * gaps + 1.0, 0.0)]
    for k in range(gaps, -1, -1):
        height, floor = chance.uniform(1.0, 3.0), chance.uniform(0.2, 0.8)
        points += [(2.0 * k + 1.0, height), (2.0 * k, height)]
        if k > 0:
            points += [(2.0 * k, floor), (2.0 * k - 1.0, floor)]
    return points


def convex(chance: random.Random) -> Outline:
    count = chance.randint(3, 12)
    turns = [2 * math.pi * (k + chance.uniform(0.0, 0.6)) / count for k in range(count)]
    return [(math.cos(t), math.sin(t)) for t in turns]


def window(chance: random.Random) -> Outline:
    """The bridge to the hole is run along there and back: two of its corners come twice."""
    outer = [(-2.0, -2.0), (2.0, -2.0), (2.0, 2.0), (-2.0, 2.0)]
    hole = [(-x, y) for x, y in convex(chance)]  # clockwise
    nearest = min(range(len(hole)), key=lambda k: math.dist(hole[k], outer[0]))
    return [*outer, outer[0], *hole[nearest:], *hole[: nearest + 1]]


def sheet(chance: random.Random, concave: bool) -> list[Outline]:
    """Cells of a grid; if they may be concave, grown together to polygons with all corners of the grid that lie on their
    outlines."""
    columns, rows = chance.randint(2, 7), chance.randint(2, 7)
    x = sorted(chance.uniform(0.0, 0.5) + k for k in range(columns + 1))
    y = sorted(chance.uniform(0.0, 0.5) + k for k in range(rows + 1))
    owner = {(i, j): (i, j) for i in range(columns) for j in range(rows)}
    loops = {cell: loop_of([cell]) for cell in owner}
    for _ in range(3 * columns * rows if concave else 0):
        i, j = chance.randrange(columns), chance.randrange(rows)
        other = owner.get(chance.choice([(i + 1, j), (i, j + 1)]))
        own = owner[i, j]
        if other is None or other == own:
            continue
        cells = [cell for cell, of in owner.items() if of in (own, other)]
        loop = loop_of(cells)
        if len(cells) <= 8 and loop is not None:
            owner |= dict.fromkeys(cells, own)
            del loops[other]
            loops[own] = loop
    return [[(x[i], y[j]) for i, j in loop or []] for loop in loops.values()]


def loop_of(cells: list[tuple[int, int]]) -> list[tuple[int, int]] | None:
    """The outline of grid cells, None if it is not one loop through each of its corners once."""
    sides = set()
    for i, j in cells:
        around = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)]
        for side in zip(around, [*around[1:], around[0]], strict=True):
            if side[::-1] in sides:
                sides.remove(side[::-1])
            else:
                sides.add(side)
    following = dict(sorted(sides))
    if len(following) < len(sides):
        return None
    loop = [min(following)]
    while (corner := following[loop[-1]]) != loop[0]:
        loop.append(corner)
    return loop if len(loop) == len(sides) else None


def in_space(chance: random.Random, outlines: list[Outline]) -> list[list[tuple[float, ...]]]:
    """One plane for all, moved and turned at random."""
    a, b = ([chance.gauss(0.0, 1.0) for _ in range(3)] for _ in range(2))
    size = math.sqrt(math.fsum(c * c for c in a))
    a = [c / size for c in a]
    along = math.fsum(p * q for p, q in zip(a, b, strict=True))
    b = [q - along * p for p, q in zip(a, b, strict=True)]
    size = math.sqrt(math.fsum(c * c for c in b))
    b = [c / size for c in b]
    off = [chance.uniform(-20.0, 20.0) for _ in range(3)]
    return [
        [tuple(off[k] + x * a[k] + y * b[k] for k in range(3)) for x, y in outline]
        for outline in outlines
    ]


class Mesh:
    """Points and polygons in the order in which a file has them."""

    def __init__(self, chance: random.Random, triangles: bool, concave: bool) -> None:
        self.points: list[tuple[float, ...]] = []
        self.polygons: list[list[int]] = []
        is_sheet = chance.random() < 0.5
        if triangles:
            parts = [in_space(chance, [convex(chance)[:3]]) for _ in range(chance.randint(1, 5))]
        elif is_sheet:
            parts = [in_space(chance, sheet(chance, concave))]
        else:
            kinds = (star, comb, convex, window) if concave else (convex,)
            shapes = [chance.choice(kinds) for _ in range(chance.randint(1, 5))]
            parts = [in_space(chance, [shape(chance)]) for shape in shapes]
        for outlines in parts:
            known: dict[tuple[float, ...], int] = {}
            apart = chance.random() < 0.4  # each polygon has vertices of its own
            twice = chance.random() < 0.5  # and each of its corners
            for outline in outlines:
                first = chance.randrange(len(outline))
                if apart:
                    known = {}
                corners = [
                    self._vertex(point, {} if apart and twice else known)
                    for point in outline[first:] + outline[:first]
                ]
                self.polygons.append(corners)

    def _vertex(self, point: tuple[float, ...], known: dict[tuple[float, ...], int]) -> int:
        if point not in known:
            known[point] = len(self.points)
            self.points.append(point)
        return known[point]


def obj(chance: random.Random, mesh: Mesh) -> bytes:
    end = chance.choice(["\n", "\r\n"])
    colours, normals, textures = (chance.random() < 0.5 for _ in range(3))
    negative = chance.random() < 0.3
    lines = ["# written by hand", "mtllib all materials.mtl", "o first one"]
    for point in mesh.points:
        more = f" {chance.random():.3f} 0.5 1" if colours else ""
        lines.append(f"v {' '.join(map(repr, point))}{more}")
    lines += [f"vn 0 0 {k + 1}" for k in range(3)] if normals else []
    lines += [f"vt {k} 0.{k}" for k in range(9)] if textures else []
    for polygon in mesh.polygons:
        if chance.random() < 0.5:
            lines.append(
                chance.choice(["usemtl red", "g a b", "s 1", "s off", "o next", "", "# -"])
            )
        words = []
        for v in polygon:
            word = str(v - len(mesh.points) if negative else v + 1)
            texture = str(chance.randint(1, 9)) if textures else ""
            normal = f"/{chance.randint(1, 3)}" if normals else ""
            words.append(word + (f"/{texture}" if texture or normal else "") + normal)
        joint = f" \\{end}  " if chance.random() < 0.2 else " "
        lines.append("f " + joint.join(words) + chance.choice(["", "", " # its words"]))
    lines += ["l 1 2", "p 3"] + (["l 1/3 2/9"] if textures else [])
    return (end.join(lines) + chance.choice(["", end])).encode()


def ply(chance: random.Random, mesh: Mesh) -> bytes:
    order = chance.choice("<> ").strip()
    names = {"<": "binary_little_endian", ">": "binary_big_endian", "": "ascii"}
    colours, flags, edges = (chance.random() < 0.5 for _ in range(3))
    old = chance.choice(["none", "corner", "vertex"])
    head = ["ply", f"format {names[order]} 1.0", "comment TextureFile a b.png"]
    head += [f"element vertex {len(mesh.points)}", *(f"property double {c}" for c in "xyz")]
    head += ["property float s", "property float t"] if old == "vertex" else []
    head += ["property uchar red"] if colours else []
    others = chance.random() < 0.3
    head += ["obj_info made by hand", "element material 2", "property int shininess"] * others
    head += ["property list uchar short codes"] * others
    head += [f"element face {len(mesh.polygons)}"]
    head += ["property short flags"] if flags else []
    head += ["property list uchar int vertex_indices"]
    head += ["property list uchar float texcoord"] if old == "corner" else []
    head += ["property list uchar uchar tags"] if flags else []
    head += ["element edge 2", "property int vertex1", "property int vertex2"] if edges else []
    rows: list[list[tuple[str, float]]] = []
    for point in mesh.points:
        row = [("d", c) for c in point] + ([("f", 0.5), ("f", 0.25)] if old == "vertex" else [])
        rows.append(row + ([("B", chance.randrange(256))] if colours else []))
    rows += [[("i", -7), ("B", 0)], [("i", 7), ("B", 2), ("h", -3), ("h", 300)]] * others
    for polygon in mesh.polygons:
        row = [("h", chance.randint(-9, 9))] if flags else []
        row += [("B", len(polygon)), *(("i", v) for v in polygon)]
        if old == "corner":
            row += [("B", 2 * len(polygon)), *(("f", 0.125) for _ in 2 * polygon)]
        tags = [("B", chance.randrange(9)) for _ in range(chance.randint(0, 2))]
        rows.append(row + ([("B", len(tags)), *tags] if flags else []))
    rows += [[("i", 0), ("i", 1)], [("i", 1), ("i", 2)]] if edges else []
    text = "\n".join([*head, "end_header"]) + "\n"
    if order:
        return text.encode() + b"".join(struct.pack(order + k, v) for row in rows for k, v in row)
    return (text + "".join(" ".join(repr(v) for _, v in row) + "\n" for row in rows)).encode()


def off(_: random.Random, mesh: Mesh) -> bytes:
    lines = ["OFF", f"{len(mesh.points)} {len(mesh.polygons)} 0"]
    lines += [" ".join(map(repr, point)) for point in mesh.points]
    lines += [" ".join(map(str, [len(polygon), *polygon])) for polygon in mesh.polygons]
    return ("\n".join(lines) + "\n").encode()


def stl(_: random.Random, mesh: Mesh) -> bytes:
    corners = [mesh.points[v] for polygon in mesh.polygons for v in polygon]
    facets = b"".join(
        struct.pack("<12f2x", 0.0, 0.0, 0.0, *corners[k], *corners[k + 1], *corners[k + 2])
        for k in range(0, len(corners), 3)
    )
    return b" " * 80 + struct.pack("<I", len(mesh.polygons)) + facets


WRITERS = {"obj": obj, "ply": ply, "off": off, "stl": stl}


def files(seeds: Iterable[int], *, concave: bool = True) -> Iterator[tuple[str, bytes]]:
    for seed in seeds:
        chance = random.Random(seed)
        ending = chance.choice(ENDINGS)
        mesh = Mesh(chance, ending == "stl", concave)
        yield f"m{seed:05}.{ending}", WRITERS[ending](chance, mesh)
