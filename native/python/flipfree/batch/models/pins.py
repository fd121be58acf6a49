"""What a file beside a model says about pins, in the numbers of its clean surface."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...checks import shown
from ...errors import bad_pins
from ...results import FloatArray, IntArray, Parametrization
from ...separated import SeparatedSurface, edge_keys
from .model import Model


def pins_of(model: Model) -> dict[str, Any]:
    told = model.told("pins")
    if told is None:
        raise bad_pins(
            f"{model.source.name}.pins.json is missing: the pins, such as "
            '{"points": {"0": [0.0, 0.5]}, "lines": [{"vertices": [3, 4], "uv": [[0, 0], [1, 0]]}]}.'
        )
    return told


def points_told(
    model: Model, clean: SeparatedSurface, told: dict[str, Any]
) -> dict[int, tuple[float, float]]:
    given = told.get("points", {})
    try:
        points = {int(v): (float(uv[0]), float(uv[1])) for v, uv in given.items()}
    except (AttributeError, TypeError, ValueError, IndexError):
        raise bad_pins(
            'points must be {"vertex": [u, v], ...}. Correct the file with the pins.'
        ) from None
    refuse_unknown(model, points)
    return clean.copies(points)


def lines_told(
    model: Model, clean: SeparatedSurface, told: dict[str, Any]
) -> list[tuple[list[int], FloatArray]]:
    copy = first_copies(model, clean)
    lines = []
    for line in told.get("lines", []):
        try:
            vertices, uv = (
                list(map(int, line["vertices"])),
                np.array(line["uv"], float).reshape(-1, 2),
            )
        except (KeyError, TypeError, ValueError):
            raise bad_pins(
                'lines must be [{"vertices": [...], "uv": [[u, v], ...]}, ...]. '
                "Correct the file with the pins."
            ) from None
        refuse_unknown(model, vertices)
        if len(vertices) < 2:
            raise bad_pins("A line needs two vertices at least. Correct it.")
        lines.append((copy[vertices].tolist(), uv))
    return lines


def first_copies(model: Model, clean: SeparatedSurface) -> IntArray:
    """(n,) the first copy on the clean surface of each vertex, -1 if there is none."""
    copy = np.full(len(model.vertices), -1, np.int32)
    copy[clean.vertex_origin[::-1]] = np.arange(len(clean.vertices), dtype=np.int32)[::-1]
    return copy


def outline_told(
    model: Model, clean: SeparatedSurface, told: dict[str, Any]
) -> tuple[dict[int, tuple[float, float]], dict[int, list[int]], set[int]]:
    """Whole boundaries in order, with their places; from points on it the way to one; and what of it may move. In copies."""
    try:
        outline = told.get("outline", {"vertices": [], "uv": []})
        loop = list(map(int, outline["vertices"]))
        places = np.array(outline["uv"], float).reshape(-1, 2).tolist()
        paths = {int(v): list(map(int, path)) for v, path in told.get("paths", {}).items()}
        movable = list(map(int, told.get("movable", [])))
        named = [*loop, *paths, *movable, *(v for path in paths.values() for v in path)]
        pairs = list(zip(loop, map(tuple, places), strict=True))
    except (AttributeError, KeyError, TypeError, ValueError):
        raise bad_pins(
            'outline must be {"vertices": [...], "uv": [[u, v], ...]}, one place for each, paths {"vertex": [...]}, and '
            "movable [vertices]. Correct the file with the pins."
        ) from None
    refuse_unknown(model, named)
    copy = first_copies(model, clean).tolist()
    return (
        {copy[v]: uv for v, uv in pairs},
        {copy[v]: [copy[w] for w in path] for v, path in paths.items()},
        {copy[v] for v in movable},
    )


def refuse_unknown(model: Model, vertices: Any) -> None:
    known = set(np.unique(model.faces).tolist())
    for v in vertices:
        if v not in known:
            raise bad_pins(
                f"Vertex {v} is no face's (numbers from 0, the first of those in one place). "
                "Correct the file beside the model."
            )


def refuse_split_cuts(clean: SeparatedSurface, found: Parametrization, cuts: IntArray) -> None:
    """The two sides of a cut are mapped each by itself, so that a vertex added on one is missing on the other."""
    added = slice(len(clean.vertices), None)
    weights = found.vertex_barycentric[added]
    corners = clean.vertex_origin[clean.faces[found.vertex_parent[added]]]
    on_edge = (weights == 0.0).any(axis=1)
    ends = corners[on_edge][weights[on_edge] != 0.0].reshape(-1, 2)
    split = ends[np.isin(edge_keys(ends), edge_keys(cuts))]
    if len(split):
        raise bad_pins(
            f"The pins cannot be met without splitting the cut edge {shown(split[0].tolist())} on one side only. Move pins away "
            "from it, or cut the part elsewhere yourself."
        )
