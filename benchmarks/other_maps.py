"""Maps that others make, for repair_maps.py: xatlas, and Blender's unwrap with pins that were moved."""

from __future__ import annotations

import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

WORKER = Path(__file__).resolve().parent / "blender_pins_worker.py"
Corners = npt.NDArray[np.float64]


def xatlas_map(vertices: npt.NDArray[np.float64], faces: npt.NDArray[np.int64]) -> Corners | None:
    """(m, 3, 2), or None if it gives faces back in another order. Wants the package xatlas."""
    import xatlas

    origin, corners, uv = xatlas.parametrize(vertices.astype(np.float32), faces.astype(np.uint32))
    if corners.shape != faces.shape or not np.array_equal(origin[corners], faces):
        return None
    found: Corners = uv[corners].astype(np.float64)
    return found


def blender_maps(blender: Path, folder: Path, meshes: dict[int, dict[str, Any]]) -> None:
    """Leaves folder/SEED.npz with vertices, faces and uv (m, 3, 2) of these meshes: vertices, faces, seams (s, 2)."""
    for seed, mesh in meshes.items():
        np.savez(folder / f"{seed}.mesh.npz", **mesh)
    command = [str(blender), "-b", "--factory-startup", "--python-exit-code", "1"]
    subprocess.run(
        [*command, "--python", str(WORKER), "--", str(folder)],
        check=True,
        stdout=subprocess.DEVNULL,
    )
