"""Draws models with their automatic seams beside Smart UV Project's: seams and checker on the model, and the islands.

    PYTHONPATH=build/python python3 benchmarks/auto_seams_looks.py FOLDER [NAME ...] [--blender build/blender-5.2/blender]
        [--sheet FILE.png]

Writes FOLDER/NAME.png: above ours, below Smart UV Project (left out without --blender); from two sides, seams that are seen
black, then the islands. FILE: all of them in two columns. Needs the shared data folder (FLIPFREE_DATA) and Pillow. Names: of its folder seams.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image, ImageDraw

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "scripts"))

from auto_seams import WORKER, seams_and_islands  # noqa: E402
from render_conformal import SIZE, View, camera, draw_edges, rasterise, shade  # noqa: E402

import flipfree as ff  # noqa: E402

from mesh_files import data_folder, read_mesh  # noqa: E402

MODELS = (
    "horse_f10000",
    "bunny",
    "cow2",
    "hand_1_i_f5000",
    "octopus_mainComp_f6000",
    "lucy_o_f8000",
    "chinese_lion_i_f10000",
    "planck1",
    "male_body_i_f10000",
    "cat_noUV",
)
#: Squares of the checker along the square root of the surface's area.
SQUARES = 24
COLOURS = np.array(
    [
        [0.55, 0.73, 0.90],
        [0.95, 0.77, 0.52],
        [0.66, 0.84, 0.60],
        [0.90, 0.62, 0.60],
        [0.76, 0.66, 0.86],
        [0.80, 0.70, 0.62],
        [0.92, 0.72, 0.85],
        [0.78, 0.78, 0.78],
        [0.85, 0.85, 0.55],
        [0.58, 0.84, 0.86],
    ]
)


def smart(program: str, models: dict[str, tuple[Any, Any]]) -> dict[str, Any]:
    """Smart UV Project on all models, in one Blender."""
    with tempfile.TemporaryDirectory() as folder:
        for name, (vertices, faces) in models.items():
            np.savez(Path(folder) / f"{name}.npz", vertices=vertices, faces=faces)
        command = [program, "-b", "--factory-startup", "--python-exit-code", "1", "--python"]
        subprocess.run([*command, str(WORKER), "--", folder], check=True, capture_output=True)
        return {
            name: np.load(Path(folder) / f"{name}.smart.npz")["uv"].astype(float) for name in models
        }


def from_side(vertices: Any, faces: Any, uv: Any, seams: Any, colour: Any, view: View) -> Any:
    screen = camera(vertices, view)
    face, weights, depth = rasterise(screen, faces)
    d1, d2 = uv[:, 1] - uv[:, 0], uv[:, 2] - uv[:, 0]
    drawn = 0.5 * np.abs(d1[:, 0] * d2[:, 1] - d1[:, 1] * d2[:, 0]).sum()
    squares = np.floor(np.einsum("yxk,yxkc->yxc", weights, uv[face]) * SQUARES / np.sqrt(drawn))
    dark = np.where(squares.sum(-1) % 2 == 0, 1.0, 0.78)[..., None]
    image = np.where(
        (face >= 0)[..., None],
        colour[face] * dark * shade(vertices, faces, view)[face][..., None],
        1.0,
    )
    draw_edges(image, depth, screen, seams)
    shifted = screen + [1.0, 1.0, 0.0]
    draw_edges(image, depth, shifted, seams)
    return image


def islands_of(faces: Any, uv: Any, colour: Any) -> Any:
    low, high = uv.reshape(-1, 2).min(0), uv.reshape(-1, 2).max(0)
    places = (uv - low) * (0.96 * SIZE / (high - low).max()) + 0.02 * SIZE
    image = Image.new("RGB", (SIZE, SIZE), "white")
    draw = ImageDraw.Draw(image)
    for corners, c in zip(places, (255 * colour).astype(int), strict=True):
        draw.polygon([(x, SIZE - y) for x, y in corners.tolist()], fill=tuple(c.tolist()))
    return np.asarray(image) / 255.0


def row(vertices: Any, faces: Any, uv: Any, up: str) -> Any:
    seams, island = seams_and_islands(faces, uv)
    colour = COLOURS[np.unique(island, return_inverse=True)[1] % len(COLOURS)]
    sides = [
        from_side(vertices, faces, uv, seams, colour, View(azimuth, 15, up))
        for azimuth in (35, 215)
    ]
    return np.hstack([*sides, islands_of(faces, uv, colour)])


def sheet_of(pictures: list[Image.Image]) -> Image.Image:
    """In two columns, half as large."""
    width, height = (size // 2 for size in pictures[0].size)
    sheet = Image.new("RGB", (2 * width, (len(pictures) + 1) // 2 * height), "white")
    for i, picture in enumerate(pictures):
        cell = picture.resize((width, height), Image.Resampling.LANCZOS)
        sheet.paste(cell, (i % 2 * width, i // 2 * height))
    return sheet.quantize(128)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("names", nargs="*", default=MODELS)
    parser.add_argument("--blender")
    parser.add_argument("--sheet", type=Path)
    arguments = parser.parse_args()
    data = data_folder()
    if data is None:
        sys.exit("The shared data folder is not here (FLIPFREE_DATA).")
    arguments.folder.mkdir(parents=True, exist_ok=True)
    models = {}
    for name in arguments.names:
        mesh = read_mesh(data / "seams" / f"{name}.obj")
        models[name] = mesh.vertices, mesh.faces
    peers = smart(arguments.blender, models) if arguments.blender else {}
    pictures = []
    for name, (vertices, faces) in models.items():
        maps = [np.asarray(ff.unwrap(vertices, faces, seams="auto").uv)]
        if name in peers:
            maps.append(peers[name])
        up = "y" if np.ptp(vertices[:, 1]) >= np.ptp(vertices[:, 2]) else "z"
        image = np.vstack([row(vertices, faces, uv, up) for uv in maps])
        pixels = Image.fromarray((255 * np.clip(image, 0, 1)).astype(np.uint8))
        small = pixels.resize((pixels.width // 2, pixels.height // 2), Image.Resampling.LANCZOS)
        small.save(arguments.folder / f"{name}.png", optimize=True)
        pictures.append(small)
        print(name, flush=True)
    if arguments.sheet:
        sheet_of(pictures).save(arguments.sheet, optimize=True)


if __name__ == "__main__":
    main()
