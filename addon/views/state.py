# SPDX-License-Identifier: GPL-3.0-or-later
"""What is switched on, for all editors of the session; nothing of it is kept with the file."""

from dataclasses import dataclass, field


def _rows(told: dict[str, str]) -> tuple:
    """(identifier, name, description, icon) of each {"identifier icon": "name: description"}."""
    pairs = ((key.split(), text.split(": ", 1)) for key, text in told.items())
    return tuple((name, *texts, icon) for (name, icon), texts in pairs)


FACES = _rows(
    {
        "distortion MOD_WARP": "Distortion: Colour faces by symmetric Dirichlet: lengths that grow or shrink, angles that "
        "change. 1 is none",
        "angle DRIVER_ROTATIONAL_DIFFERENCE": "Angle: Colour faces by shear: how much longer the map makes one direction "
        "than the other. 1 is none",
        "area FIXED_SIZE": "Area: Colour faces by size: their area in the map over that on the surface, 1 on average",
        "density TEXTURE": "Texel Density: Colour faces by pixels of the texture per unit of the scene",
        "faults ERROR": "Wrong Faces: Show faces that are flipped, without area or overlapping, as exact arithmetic finds "
        "them",
    }
)
MARKS = _rows(
    {
        "cones MESH_CONE": "Cones: Show cones with their quarter turns, and what the surface still lacks (Gauss-Bonnet)",
        "field EMPTY_AXIS": "Field: Show the directions of the attribute `flipfree_field`",
        "seams EDGESEL": "Seams and Turns: Show seams, in the colour of the quarter turns that a seamless map makes across "
        "them",
        "pins PINNED": "Pins: Show pinned UVs, and in red those that contradict each other",
    }
)
ALL = tuple(row[0] for row in FACES + MARKS)


@dataclass
class State:
    """faces: one of FACES or ""."""

    faces: str = ""
    marks: set[str] = field(default_factory=set)
    version: int = 0  # grows with every change


current = State()


def anything() -> bool:
    return bool(current.faces or current.marks)


def is_on(what: str) -> bool:
    return what == current.faces or what in current.marks


def switch(what: str, on: bool) -> None:
    """One of FACES at a time; of MARKS any."""
    if what in {row[0] for row in FACES}:
        if on or current.faces == what:
            current.faces = what if on else ""
    elif on:
        current.marks.add(what)
    else:
        current.marks.discard(what)
    current.version += 1


def switch_all_off() -> None:
    current.faces = ""
    current.marks.clear()
    current.version += 1
