"""Pictures of UV maps as PNG files, with numpy and the standard library alone."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Mapping
from pathlib import Path

import numpy as np


def write_png(path: Path, image: np.ndarray) -> None:
    """image: (height, width, 3) uint8."""
    height, width, _ = image.shape
    raw = np.hstack([np.zeros((height, 1), np.uint8), image.reshape(height, -1)]).tobytes()

    def chunk(kind: bytes, data: bytes) -> bytes:
        body = kind + data
        return struct.pack(">I", len(data)) + body + struct.pack(">I", zlib.crc32(body))

    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(
        b"\x89PNG\r\n\x1a\n"
        + chunk(b"IHDR", header)
        + chunk(b"IDAT", zlib.compress(raw, 9))
        + chunk(b"IEND", b"")
    )


def draw(
    path: Path,
    uv: np.ndarray,
    faces: np.ndarray,
    pins: Mapping[int, tuple[float, float]],
    size: int = 640,
) -> None:
    """Edges of the map in grey, flipped triangles' edges in red, pins as blue squares."""
    points = uv.reshape(-1, 2)
    low, high = points.min(0), points.max(0)
    scale = (size - 41) / (high - low).max()
    image = np.full((size, size, 3), 255, np.uint8)

    def place(p: np.ndarray) -> np.ndarray:
        q = (p - low) * scale + 20
        return np.stack([q[..., 0], size - 1 - q[..., 1]], -1)

    corners = place(uv)
    a, b, c = uv[:, 0], uv[:, 1], uv[:, 2]
    area = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])
    for wanted, colour in ((area > 0, (150, 150, 150)), (area <= 0, (220, 30, 30))):
        for k in range(3):
            start, end = corners[wanted, k], corners[wanted, (k + 1) % 3]
            if not len(start):
                continue
            steps = np.ceil(np.abs(end - start).max(1)).astype(int) + 1
            which = np.repeat(np.arange(len(start)), steps)
            local = np.arange(len(which)) - np.repeat(np.cumsum(steps) - steps, steps)
            t = (local / np.maximum(steps - 1, 1)[which])[:, None]
            pixel = np.rint(start[which] + t * (end[which] - start[which])).astype(int)
            inside = ((pixel >= 0) & (pixel < size)).all(1)
            image[pixel[inside, 1], pixel[inside, 0]] = colour
    for target in pins.values():
        x, y = np.rint(place(np.array(target))).astype(int)
        image[max(y - 3, 0) : y + 4, max(x - 3, 0) : x + 4] = (30, 60, 220)
    write_png(path, image)
