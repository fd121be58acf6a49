# SPDX-License-Identifier: GPL-3.0-or-later
"""Test images, made from nothing: rows of pixels from the bottom, linear greys and colours."""

import numpy as np

from .. import aspect

SIZE = 1024  # of the longer side
PATTERNS = {
    "grid": "Numbered Squares: Coloured squares with a letter and a number each: stretch, flips and places",
    "brick": "Brick: Rows of bricks: direction, size, and where seams cut them",
    "symmetric": "Quarter-Turn Symmetric: Looks the same after a quarter turn: goes on across the seams of a seamless map",
}


def size(ratio: float) -> tuple[int, int]:
    """(width, height) for textures so many times as wide as high."""
    width, height = (int(round(SIZE * side)) for side in aspect.sides(ratio))
    return width, height


def pixels(name: str, ratio: float = 1.0) -> np.ndarray:
    """(height, width, 4) float32 of "brick" or "symmetric"; the grid is one of Blender's own generated images."""
    width, height = size(ratio)
    v, u = np.meshgrid(
        (np.arange(height) + 0.5) / SIZE, (np.arange(width) + 0.5) / SIZE, indexing="ij"
    )
    grey = {"brick": _brick, "symmetric": _symmetric}[name](u, v)
    return np.concatenate([grey, np.ones((height, width, 1))], axis=2).astype(np.float32)


def _brick(u: np.ndarray, v: np.ndarray) -> np.ndarray:
    """16 rows of 8 bricks, every second one moved by half a brick; each brick its own shade of red."""
    row = np.floor(16 * v)
    along = 8 * u + 0.5 * (row % 2)
    number = np.floor(along) % 8
    joint = (np.abs(along % 1 - 0.5) > 0.46) | (np.abs(16 * v % 1 - 0.5) > 0.42)
    shade = 0.75 + 0.25 * np.sin(12.9898 * number + 78.233 * row)
    brick = shade[..., None] * np.array([0.62, 0.22, 0.13])
    return np.where(joint[..., None], np.array([0.75, 0.72, 0.66]), brick)


def _symmetric(u: np.ndarray, v: np.ndarray) -> np.ndarray:
    """16 x 16 tiles of a ring on a cross, each the same after a quarter turn about its centre, as is the whole."""
    x, y = 16 * u % 1 - 0.5, 16 * v % 1 - 0.5
    radius = np.hypot(x, y)
    cross = np.minimum(np.abs(x), np.abs(y)) < 0.06
    ring = np.abs(radius - 0.3) < 0.06
    colour = np.where(ring[..., None], [0.10, 0.30, 0.65], [0.88, 0.86, 0.80])
    return np.where((cross & ~ring)[..., None], [0.80, 0.35, 0.10], colour)
