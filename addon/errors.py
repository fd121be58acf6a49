# SPDX-License-Identifier: GPL-3.0-or-later
"""What the user is told when a map cannot be made: what is wrong, where in their mesh, and what to do in Blender.

The solver names a defect by a fixed code and by ids of its own submesh; here both are put into the user's terms.
docs/errors.md has the same table for readers; tests/blender/test_errors.py makes one mesh for each.
"""

import functools
import re
import textwrap
from dataclasses import dataclass

import bpy
import numpy as np

import flipfree

from .meshes import mesh_io

# Solver's code -> what is wrong with the place that is named. What to do about it in Blender.
TEXTS = {
    "empty mesh": "has no faces. Add or select some",
    "array of the wrong shape": "was read wrongly. Please report this as a bug",
    "index out of range": "was read wrongly. Please report this as a bug",
    "coordinate is not finite": "has a coordinate that is no number. Delete it in Edit Mode",
    "face uses a vertex twice": "uses one vertex twice. Run bpy.context.object.data.validate() in the Python console, which "
    "removes such faces",
    "duplicate face": "has the same vertices as another face. Delete it in Edit Mode (Delete > Only Faces)",
    "non-manifold edge": "belongs to more than two faces. Select it and use Mesh > Split > Faces by Edges, or delete the "
    "inner faces",
    "inconsistent orientation": "joins two faces that look to opposite sides. Select all (A) in Edit Mode and use Mesh > "
    "Normals > Recalculate Outside",
    "non-manifold vertex": "joins parts of the surface that share no edge. Select it and use Mesh > Split > Faces & Edges by "
    "Vertices",
    "zero-area face": "has a triangle without area. Select all (A) in Edit Mode and use Mesh > Clean Up > Degenerate "
    "Dissolve; for a quad, Face > Triangulate Faces",
    "zero-length edge": "has no length. Select all (A) in Edit Mode and use Mesh > Merge > By Distance",
    "isolated vertex": "belongs to no face. Use Mesh > Clean Up > Delete Loose",
    "mesh is not connected": "has separate parts. Use Mesh > Separate > By Loose Parts",
    "mesh is not a disk": "cannot be flattened in one piece. Mark seams that open it, or choose a part of it",
    "not an edge of the mesh": "is no edge. Please report this as a bug",
    "bad option": "cannot be treated with these options. Change them in the redo panel",
    "map has flips": "is flipped or has no area in the UV map. Use Repair Flips, or unwrap it first",
    "bad boundary": "has a boundary that does not fit its target. Pin the whole loop or none of it",
    "polygon is not convex": "has a target boundary that is not convex. Use Match Pins for such targets",
    "no quad": "is no quad. Rectify takes islands of quads: select others, or mark seams around it",
    "no grid": "is in no grid: other than four quads meet inside its island, or the island lies on itself. Mark seams through "
    "such vertices, or select other islands",
    "bad pins": "has a pin that cannot be met. Move it, or unpin it with Alt P",
    "bad angles": "has a cone angle that no surface has. Give it another angle, above zero",
    "no room in the polygon": "does not fit into its target. Make the target larger or move its pins",
    "polygon is not weakly self-overlapping": "has a target boundary that bounds no surface. Move the pinned boundary so that "
    "it turns once in total",
    "contradictory pins": "has pins that contradict each other. Move or unpin one of them",
    "angles violate Gauss-Bonnet": "has cones that do not sum to what its shape needs. Suggest Cones places them, Mark Cone "
    "shows the missing remainder",
    "iteration limit reached": "took more steps than allowed. Mark more seams, or clean up thin faces",
    "line search stalled": "could not be improved further. Mark more seams, or clean up thin faces",
    "factorization failed": "is numerically too badly shaped. Clean up thin or tiny faces there",
    "rounding to 32 bits flips triangles": "is too finely detailed for Blender's 32-bit UVs. Mark more seams, so that each "
    "island needs less range",
    "certificate failed": "has a map that failed its check. Please report this as a bug",
    "time limit reached": "got no map in the time allowed. Allow more time in the redo panel, or pin fewer vertices",
    "out of memory": "needs more memory than there is. Close other programs, or unwrap it in parts",
    "solver process not started": "got no process for its solver. Set Preferences > Add-ons > Flipfree UV > Separate Process "
    "to Never",
    "solver process ended": "was not finished, because its solver's process ended. Nothing else is harmed. Close other "
    "programs, or select less and unwrap it in parts",
    "cancelled": "was not finished. Run the operator again",
    "internal error": "met an error inside the solver. Please report this as a bug",
}


HINT = "Flipfree > Select Where It Failed shows the place"

# Characters of a line in popups: these are as wide as their longest line, and the screen ends somewhere.
_WIDTH = 100

# Characters that the status bar has room for.
_STATUS = 119
_MORE = " (more in the sidebar)"
_said = [""]

# Of the last run, those with a place; Select Where It Failed asks for them.
_remembered: list["Failure"] = []


@dataclass
class Failure:
    """Why one object got no map. `kind` and `elements` are ids of the Blender mesh, for selecting them."""

    object_name: str
    message: str
    kind: str = "none"
    elements: np.ndarray | None = None
    counts: tuple = ()  # of the mesh that the ids belong to (mesh_io.counts)
    code: str = ""  # of the solver's exception
    refused: bool = True  # the mesh or what is asked of it is at fault, not the solver or its time

    def __str__(self):
        return self.message

    @property
    def has_place(self) -> bool:
        return self.kind != "none" and self.elements is not None and len(self.elements) > 0


def remember(failures: list[Failure]) -> bool:
    """Keeps the failures of a run until the next one; True if some have a place to show."""
    _remembered[:] = [failure for failure in failures if failure.has_place]
    for failure in _remembered:
        ob = bpy.data.objects.get(failure.object_name)
        failure.counts = () if ob is None else mesh_io.counts(ob)
    return bool(_remembered)


def has_places() -> bool:
    return bool(_remembered)


def places() -> list[tuple[bpy.types.Object, Failure]]:
    """What the last run remembered and still holds: objects that are there, with meshes of the same size."""
    found = [(bpy.data.objects.get(f.object_name), f) for f in _remembered]
    return [(ob, f) for ob, f in found if ob is not None and mesh_io.counts(ob) == f.counts]


def _has_window() -> bool:
    return not bpy.app.background


def in_lines(text: str) -> str:
    """The text in lines that popups can show whole."""
    wrap = functools.partial(
        textwrap.wrap, width=_WIDTH, break_long_words=False, break_on_hyphens=False
    )
    return "\n".join(line for given in text.split("\n") for line in wrap(given) or [""])


def complain(operator, text: str) -> None:
    """Reports an error; where Blender has windows, that is a popup. Others get the text as it is."""
    operator.report({"ERROR"}, in_lines(text) if _has_window() else text)


def tell(operator, kind: str, text: str, first: str = "") -> None:
    """Reports a line. In a window the status bar has room for so many characters, `first` before the rest; the sidebar has the
    whole. Others get the whole."""
    _said[:] = [text]
    operator.report({kind}, for_status_bar(first or text) if _has_window() else text)


def for_status_bar(text: str) -> str:
    """As many of its clauses as there is room for."""
    text = " ".join(text.split())
    if len(text) <= _STATUS:
        return text
    room = _STATUS - len(_MORE)
    ends = [m.start() for m in re.finditer(r"[,;:.] ", text[: room + 2])]
    found = text[: ends[-1]] if ends else textwrap.shorten(text, room, placeholder=" ...")
    return found + _MORE


def said() -> str:
    """The whole of the last line that was reported."""
    return _said[0]


def _place(kind: str, elements: np.ndarray) -> str:
    if kind == "none" or len(elements) == 0:
        return ""
    return f"{kind} {elements[0]}{mesh_io.more(elements)} "


def from_solver(snapshot: mesh_io.Snapshot, error, cures: dict[str, str] | None = None) -> Failure:
    """Failure for an exception of flipfree.errors. cures: of the operator, where the usual ones do not help: {code: what to
    do}."""
    failure = _in_blenders_terms(snapshot, error, cures)
    failure.code = error.code
    failure.refused = isinstance(error, flipfree.InvalidInput | flipfree.Infeasible)
    return failure


# In the solver's words: its vertices, and what it says of meshes that only it has.
_VERTICES = re.compile(r"\b[Vv]ert(?:ex|ices) \d+(?:(?:, | and )\d+)*")
_OF_REFINED = re.compile(
    r",? first (?:face|vertex) \d+(?= with|\.)|\s*\(Numbers are those of the refined mesh\)\.?"
)
_TWO_SIDES = (
    "lies on both sides of a seam that ends inside its island, and both are pinned to the same point. Unpin one of them with "
    "Alt P, or clear the seam there"
)


def _in_mesh_numbers(snapshot, error) -> str:
    """The solver's own words with the mesh's vertices in place of its own; "" if they name one that the mesh does not have."""
    words = str(error)
    if "refined mesh" in words:
        words = _OF_REFINED.sub("", words)
    ids = snapshot.vertex_ids
    part = getattr(error, "vertices", None)  # those of the snapshot that the solver had, if not all
    ids = ids if part is None else ids[part]
    named = [int(n) for found in _VERTICES.findall(words) for n in re.findall(r"\d+", found)]
    if any(n >= len(ids) for n in named):
        return ""
    return _VERTICES.sub(
        lambda found: re.sub(r"\d+", lambda n: str(ids[int(n[0])]), found[0]), words
    )


def _in_blenders_terms(snapshot, error, cures) -> Failure:
    kind, elements = mesh_io.to_mesh_elements(snapshot, error.kind, error.elements)
    known = TEXTS.get(error.code)
    if known is None:
        return Failure(snapshot.object_name, f"{snapshot.object_name}: {error}", kind, elements)
    if error.code == "contradictory pins" and kind == "vertex" and len(elements) == 1:
        if len(error.elements) == 2:  # of the solver's surface, where the sides of a seam are apart
            message = f"{snapshot.object_name}: vertex {elements[0]} {_TWO_SIDES}"
            return Failure(snapshot.object_name, message, kind, elements)
    what, _, cure = known.partition(". ")
    cure = (cures or {}).get(error.code, cure)
    place = _place(kind, elements)
    message = f"{snapshot.object_name}: {place or 'the surface '}{what}. {cure}"
    # Numbers that only the solver knows (a missing angle, two pins) follow in its own words.
    if not place or error.code in WITH_SOLVER_TEXT:
        said = _in_mesh_numbers(snapshot, error)
        said = said.partition(". ")[0] if error.code in FIRST_SENTENCE else said
        message += f" ({said})" if said else ""
    if error.code in NOT_FOR_EDIT_MODE:
        kind, elements = "none", None
    return Failure(snapshot.object_name, message, kind, elements)


# Such meshes must not be shown: Blender hangs when it selects something in them in Edit Mode.
NOT_FOR_EDIT_MODE = {"face uses a vertex twice"}

# Codes whose solver message says more than the place.
WITH_SOLVER_TEXT = {
    "bad option",
    "bad pins",
    "bad angles",
    "contradictory pins",
    "no room in the polygon",
    "angles violate Gauss-Bonnet",
    "line search stalled",
    "certificate failed",
    "internal error",
}

# Codes of which the rest of the solver's message is a cure of its own.
FIRST_SENTENCE = {"solver process not started", "solver process ended"}


def from_problem(object_name: str, problem: mesh_io.MeshProblem) -> Failure:
    return Failure(object_name, str(problem), problem.kind, problem.elements)
