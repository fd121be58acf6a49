"""What rerouting is for (thesis table 6.2): how well maps follow a field whose turns along handles they have, or have not.

    PYTHONPATH=build/python:tests:benchmarks python3 benchmarks/field_aligned_rerouting.py [--only TEXT] [--seconds 120] [--pictures FOLDER]

Cases: fields/ with its fields. A row per model: after the same alignment, E_A, the mean of |J - T|² / 2 by area, E, which is E_A + 1e-3 times
the symmetric Dirichlet energy, and the mean angle to the field in degrees, of the engine "padding" with branches rerouted until loops turn as the field does, of the same
without, and of the engine "penner". `rerouted`: branches, and the quarter turns that the loops were off. The exit status is 1 if there is no map with rerouting, or one that has a
larger E than that without where something was rerouted.
`--pictures`: no table, but docs/images/field_aligned_cut_*.png, as thesis figure 6.9: the cut, without and with rerouting, and a checker on the maps.
"""

from __future__ import annotations

import argparse
import sys
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from field_aligned import Mesh, genus_of, given

import flipfree as ff
from flipfree import _native
from flipfree.arrays import as_indices, as_vertices
from flipfree.conversions import parametrization_from
from flipfree.fields.cross_fields import arrays_of
from flipfree.job import Job, run

from mesh_files import data_folder

SMOOTHNESS = 1e-3
WAYS = ("padding, rerouted", "padding, as it is", "penner")


def aligned(mesh: Mesh, field: ff.CrossField, way: str, seconds: float) -> ff.Parametrization:
    _, vertices, faces = mesh
    face_array = as_indices(faces, "faces", 3)
    positions = as_vertices(vertices, face_array)
    options = dict(
        engine=way.split(",")[0], reroute=way != "padding, as it is", max_seconds=seconds
    )
    arrays = arrays_of(field, face_array)
    native = _native.field_aligned(positions.scaled, face_array, arrays, {}, options, 0)
    return run(Job(native, partial(parametrization_from, positions=positions)))


def energies(map: ff.Parametrization) -> tuple[float, float]:
    alignment = float(map.stats["alignment.energy"])
    return alignment, alignment + SMOOTHNESS * map.certificate.energy


def row(mesh: Mesh, field: ff.CrossField, seconds: float) -> tuple[str, bool]:
    total: dict[str, float] = {}
    cells = []
    rerouted = 0
    done = ""
    for way in WAYS:
        try:
            map = aligned(mesh, field, way, seconds)
        except ff.FlipfreeError as error:
            cells.append(f"{error.code} | | ")
            continue
        if way == WAYS[0]:
            s: dict[str, Any] = map.stats
            rerouted = s["reroutings.guided"] + s["reroutings.fallback"]
            done = f"{rerouted}, {s['reroutings.quarters']}"
        part, total[way] = energies(map)
        cells.append(f"{total[way]:.4f} | {part:.4f} | {np.degrees(map.stats['angle_mean']):.1f}")
    lower = WAYS[0] in total and (rerouted == 0 or total[WAYS[0]] < total.get(WAYS[1], np.inf))
    return f"| {mesh[0]} | {genus_of(mesh)} | {done} | " + " | ".join(cells) + " |", lower


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", default="", help="cases whose name contains this")
    parser.add_argument("--seconds", type=float, default=120.0, help="give a map up after so long")
    parser.add_argument("--pictures", type=Path, help="draw instead, into this folder")
    arguments = parser.parse_args()
    folder = data_folder()
    if folder is None:
        sys.exit("The shared data folder is not here (FLIPFREE_DATA).")
    cases = [(mesh, field) for mesh, field in given(folder) if arguments.only in mesh[0]]
    if arguments.pictures:
        from field_aligned_cuts import draw

        for mesh, field in cases:
            maps = [aligned(mesh, field, way, arguments.seconds) for way in WAYS[1::-1]]
            draw(arguments.pictures / f"field_aligned_cut_{mesh[0]}.png", mesh, field, maps)
        return 0
    columns = "model | genus | rerouted, quarters"
    for way in WAYS:
        columns += f" | {way}: E | E_A | degrees"
    print(f"| {columns} |\n|" + "---|" * (columns.count("|") + 1))
    good = 0
    for mesh, field in cases:
        text, lower = row(mesh, field, arguments.seconds)
        good += lower
        print(text, flush=True)
    print(f"\n{good} of {len(cases)}: lower with rerouting, or nothing to reroute")
    return int(good < len(cases))


if __name__ == "__main__":
    sys.exit(main())
