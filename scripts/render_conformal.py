"""Pictures of conformal maps for docs/method/conformal.md: hierarchical grid texture, cones, scale factor.

    PYTHONPATH=build/python python3 scripts/render_conformal.py OUTPUT_FOLDER [NAME ...]

The grid (thesis 4.6) halves the spacing of its lines where the scale factor is halved, so that lines stay legible over
any range of scales. Cones are dots: red for angles below 2 pi, green above. Cuts are drawn dark. A plain z-buffer in
numpy; needs Pillow.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from PIL import Image

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "tests"))
import flipfree as ff  # noqa: E402

from mesh_files import data_folder, read_mesh  # noqa: E402

SIZE = 900
LINES = 24.0  # grid lines over the surface's diameter where the scale is average


@dataclass
class View:
    azimuth: float
    elevation: float
    up: str = "z"


def camera(vertices: np.ndarray, view: View) -> np.ndarray:
    """(n, 3) screen x, y in pixels (y down) and depth (larger is nearer)."""
    points = vertices - (vertices.min(0) + vertices.max(0)) / 2
    if view.up == "y":
        points = points[:, [0, 2, 1]] * [1, -1, 1]
    a, e = np.radians(view.azimuth), np.radians(view.elevation)
    right = np.array([np.cos(a), np.sin(a), 0.0])
    forward = np.array([-np.sin(a) * np.cos(e), np.cos(a) * np.cos(e), -np.sin(e)])
    up = np.cross(right, forward)
    screen = np.stack([points @ right, -(points @ up), -(points @ forward)], 1)
    low, high = screen[:, :2].min(0), screen[:, :2].max(0)
    screen[:, :2] = (screen[:, :2] - (low + high) / 2) * (
        0.92 * SIZE / (high - low).max()
    ) + SIZE / 2
    return screen


def rasterise(screen: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Per pixel: face (-1 = none), barycentric coordinates, depth."""
    face = np.full((SIZE, SIZE), -1, np.int32)
    depth = np.full((SIZE, SIZE), -np.inf)
    weights = np.zeros((SIZE, SIZE, 3))
    for f, corners in enumerate(screen[faces]):
        (ax, ay, az), (bx, by, bz), (cx, cy, cz) = corners
        area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
        if area == 0:
            continue
        x0, x1 = max(int(np.ceil(min(ax, bx, cx))), 0), min(int(max(ax, bx, cx)), SIZE - 1)
        y0, y1 = max(int(np.ceil(min(ay, by, cy))), 0), min(int(max(ay, by, cy)), SIZE - 1)
        if x0 > x1 or y0 > y1:
            continue
        x, y = np.meshgrid(np.arange(x0, x1 + 1), np.arange(y0, y1 + 1))
        wb = ((x - ax) * (cy - ay) - (y - ay) * (cx - ax)) / area
        wc = ((bx - ax) * (y - ay) - (by - ay) * (x - ax)) / area
        wa = 1 - wb - wc
        z = wa * az + wb * bz + wc * cz
        block = (slice(y0, y1 + 1), slice(x0, x1 + 1))
        hit = (wa >= 0) & (wb >= 0) & (wc >= 0) & (z > depth[block])
        face[block][hit] = f
        depth[block][hit] = z[hit]
        weights[block][hit] = np.stack([wa, wb, wc], -1)[hit]
    return face, weights, depth


def shade(vertices: np.ndarray, faces: np.ndarray, view: View) -> np.ndarray:
    """Per face: light from the camera's upper left, both sides."""
    screen = camera(vertices, view)
    e1, e2 = (screen[faces[:, k]] - screen[faces[:, 0]] for k in (1, 2))
    normal = np.cross(e1, e2)
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
    return 0.45 + 0.55 * np.abs(normal @ (np.array([-0.4, -0.5, 0.77]) / 1.0))


def grid_colour(uv: np.ndarray, log_scale: np.ndarray, spacing: float) -> np.ndarray:
    """0 on lines, 1 between; two octaves are blended so that lines do not jump."""
    level = np.log2(spacing) + log_scale / np.log(2)
    low = np.floor(level)
    share = level - low
    out = np.zeros(uv.shape[:-1])
    for step, weight in ((low, 1 - share), (low + 1, share)):
        width = 2.0**step
        distance = np.abs((uv / width[..., None] + 0.5) % 1 - 0.5).min(-1)
        out += weight * np.clip(distance / 0.06 - 0.4, 0, 1)
    return out


def scale_colour(value: np.ndarray) -> np.ndarray:
    """-1 blue, 0 nearly white, 1 red."""
    v = np.clip(value, -1, 1)[..., None]
    blue, white, red = (
        np.array([0.15, 0.35, 0.8]),
        np.array([0.97, 0.96, 0.93]),
        np.array([0.85, 0.2, 0.12]),
    )
    return np.where(v < 0, white + (blue - white) * -v, white + (red - white) * v)


def draw_dots(
    image: np.ndarray, depth: np.ndarray, places: np.ndarray, colours: np.ndarray, radius: int
) -> None:
    y, x = np.mgrid[-radius : radius + 1, -radius : radius + 1]
    disc = np.argwhere(x * x + y * y <= radius * radius) - radius
    near = (np.ptp(places[:, 2]) if len(places) else 0.0) * 1e-9
    span = np.ptp(depth[np.isfinite(depth)]) * 0.01 + near
    for (px, py, pz), colour in zip(places, colours, strict=True):
        cx, cy = int(round(px)), int(round(py))
        if not (radius <= cx < SIZE - radius and radius <= cy < SIZE - radius):
            continue
        if depth[cy, cx] > pz + span:
            continue  # hidden
        for dy, dx in disc:
            rim = dx * dx + dy * dy > (radius - 1.5) ** 2
            image[cy + dy, cx + dx] = 0.1 if rim else colour


def draw_edges(image: np.ndarray, depth: np.ndarray, screen: np.ndarray, edges: np.ndarray) -> None:
    span = np.ptp(depth[np.isfinite(depth)]) * 0.01
    for a, b in edges:
        steps = int(np.abs(screen[a, :2] - screen[b, :2]).max()) + 1
        for t in np.linspace(0, 1, steps + 1):
            p = (1 - t) * screen[a] + t * screen[b]
            x, y = int(round(p[0])), int(round(p[1]))
            if 0 < x < SIZE - 1 and 0 < y < SIZE - 1 and depth[y, x] <= p[2] + span:
                image[y : y + 2, x : x + 2] = [0.15, 0.1, 0.1]


def render(
    vertices: np.ndarray, faces: np.ndarray, angles: np.ndarray, view: View, path: Path
) -> ff.Parametrization:
    """Left: grid, cuts and cones on the surface. Right: logarithm of the scale factor, blue small, red large."""
    result = ff.conformal(vertices, faces, angles)
    f, uv, v = result.faces, result.uv, result.vertices
    # Scale of every face: square root of UV area over area, averaged at vertices.
    e1, e2 = v[f[:, 1]] - v[f[:, 0]], v[f[:, 2]] - v[f[:, 0]]
    area = np.linalg.norm(np.cross(e1, e2), axis=1)
    d1, d2 = uv[:, 1] - uv[:, 0], uv[:, 2] - uv[:, 0]
    image_area = d1[:, 0] * d2[:, 1] - d1[:, 1] * d2[:, 0]
    total, weight = np.zeros(len(v)), np.zeros(len(v))
    for k in range(3):
        np.add.at(total, f[:, k], area * 0.5 * np.log(image_area / np.maximum(area, 1e-300)))
        np.add.at(weight, f[:, k], area)
    log_scale = total / np.maximum(weight, 1e-300)
    middle = np.average(log_scale, weights=weight)

    screen = camera(v, view)
    face, weights, depth = rasterise(screen, f)
    hit = face >= 0
    lit = shade(v, f, view)[face][..., None]
    pixel_uv = np.einsum("yxk,yxkc->yxc", weights, uv[face])
    pixel_scale = np.einsum("yxk,yxk->yx", weights, log_scale[f[face]])
    diameter = np.linalg.norm(np.ptp(vertices, axis=0))
    grid = grid_colour(pixel_uv, pixel_scale, diameter / LINES)[..., None]
    paper, ink = np.array([0.96, 0.93, 0.84]), np.array([0.18, 0.30, 0.52])
    left = np.where(hit[..., None], (ink + (paper - ink) * grid) * lit, 1.0)
    spread = max(np.abs(log_scale - middle).max(), 1e-9)
    right = np.where(hit[..., None], scale_colour((pixel_scale - middle) / spread) * lit, 1.0)
    draw_edges(left, depth, screen, result.cut_edges)
    flat = np.full(len(angles), 2 * np.pi)
    edges = {(a, b) for t in faces.tolist() for a, b in zip(t, t[1:] + t[:1], strict=True)}
    flat[[w for a, b in edges if (b, a) not in edges for w in (a, b)]] = np.pi
    # Of a curved boundary only corners are worth a dot.
    cones = np.nonzero(np.abs(angles - flat) > np.where(flat < 6, 0.6, 1e-3))[0]
    if len(cones) < 500:
        colours = np.where(
            (angles[cones] < flat[cones])[:, None], [0.85, 0.1, 0.1], [0.1, 0.6, 0.2]
        )
        for picture in (left, right):
            draw_dots(picture, depth, screen[cones], colours, 6)
    both = (np.clip(np.hstack([left, right]), 0, 1) * 255).astype(np.uint8)
    Image.fromarray(both).resize((SIZE, SIZE // 2), Image.LANCZOS).save(path, optimize=True)
    return result


def shared(name: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    folder = data_folder()
    if folder is None:
        sys.exit("The shared data folder is not here (FLIPFREE_DATA).")
    mesh = read_mesh(folder / "conformal" / f"{name}.obj")
    return mesh.vertices, mesh.faces, np.loadtxt(folder / "conformal" / f"{name}_Th_hat")


def suggested(name: str, bound: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    vertices, faces, _ = shared(name)
    return vertices, faces, np.asarray(ff.suggest_cones(vertices, faces, bound=bound))


def bump(shape: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    n = 70
    x, y = np.meshgrid(np.linspace(-1, 1, n + 1), np.linspace(-1, 1, n + 1))
    z = 0.9 * np.exp(-5 * ((x - 0.2) ** 2 + (y + 0.1) ** 2)) + 0.08 * np.sin(7 * x) * np.sin(6 * y)
    vertices = np.stack([x, y, z], -1).reshape(-1, 3)
    index = np.arange((n + 1) ** 2).reshape(n + 1, n + 1)
    a, b, c, d = (
        index[i, j].ravel()
        for i, j in (
            (np.s_[:-1], np.s_[:-1]),
            (np.s_[:-1], np.s_[1:]),
            (np.s_[1:], np.s_[1:]),
            (np.s_[1:], np.s_[:-1]),
        )
    )
    faces = np.vstack([np.stack([a, b, c], 1), np.stack([a, c, d], 1)]).astype(np.int32)
    corners = index[[0, 0, -1, -1], [0, -1, 0, -1]]
    return (
        vertices,
        faces,
        ff.boundary_angles(
            vertices, faces, shape, corners=corners if shape == "straight" else None
        ),
    )


PICTURES: dict[str, tuple[Callable[[], tuple[np.ndarray, np.ndarray, np.ndarray]], View]] = {
    "conformal_elephant": (lambda: shared("elephant"), View(30, 15, "y")),
    "conformal_aircraft": (lambda: shared("aircraft"), View(35, 30, "z")),
    "conformal_fertility": (lambda: shared("fertility_tri"), View(20, 10, "y")),
    "conformal_suggested": (lambda: suggested("elephant", 3.0), View(30, 15, "y")),
    "conformal_free": (lambda: bump("free"), View(20, 45)),
    "conformal_straight": (lambda: bump("straight"), View(20, 45)),
    "conformal_circle": (lambda: bump("circle"), View(20, 45)),
}


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("names", nargs="*", default=list(PICTURES))
    arguments = parser.parse_args()
    arguments.folder.mkdir(parents=True, exist_ok=True)
    for name in arguments.names:
        make, view = PICTURES[name]
        result = render(*make(), view, arguments.folder / f"{name}.png")
        print(name, result.certificate)
    return 0


if __name__ == "__main__":
    sys.exit(main())
