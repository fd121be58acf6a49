# SPDX-License-Identifier: GPL-3.0-or-later
"""What the operators share: which objects they work on, and the numbers they report."""

import math

import numpy as np

from flipfree import results, texts

from .. import errors, scene, watch
from ..meshes import mesh_io
from ..runs import steps


def meshes(context) -> list:
    """The mesh objects an operator works on: those in edit mode, or the selected ones. One per mesh."""
    if context.mode == "EDIT_MESH":
        return [ob for ob in context.objects_in_mode_unique_data if ob.type == "MESH"]
    found = {}
    for ob in context.selected_objects:
        if ob.type == "MESH" and ob.mode == "OBJECT" and not refusal(ob):
            found.setdefault(ob.data, ob)
    return list(found.values())


def refusal(ob) -> str:
    """Why the mesh of an object cannot be written to; "" if it can."""
    if ob.data.override_library is not None:
        why = "its mesh is a library override, and Blender keeps no changes to the geometry of such"
    elif not ob.data.is_editable:
        why = "its mesh is linked from another file"
    else:
        return ""
    return f"{ob.name}: {why}. Use Object > Relations > Make Local, Selected Objects and Data"


def refused(context) -> list[errors.Failure]:
    """The selected mesh objects that are left out, and why."""
    if context.mode == "EDIT_MESH":
        return []
    found = [(ob.name, refusal(ob)) for ob in context.selected_objects if ob.type == "MESH"]
    return [errors.Failure(name, text) for name, text in found if text]


def allowed(cls, holds: bool, why_not: str) -> bool:
    """For polls: `holds`, with the reason in the menu's tooltip where it does not."""
    if not holds:
        cls.poll_message_set(why_not)
    return holds


def poll(cls, context, *, needs_uv: bool = False) -> bool:
    """Poll of all operators, with the reason shown in the menu's tooltip."""
    if context.mode not in {"OBJECT", "EDIT_MESH"}:
        cls.poll_message_set("Works in Object Mode and in Edit Mode of meshes")
        return False
    objects = meshes(context)
    if not objects:
        cls.poll_message_set("\n".join(map(str, refused(context)[:3])) or "Select a mesh object")
        return False
    mapped = not needs_uv or any(ob.data.uv_layers.active for ob in objects)
    return allowed(cls, mapped, "The mesh has no UV map yet: unwrap it first")


class PlainOperator:
    """Mixin for operators that solve nothing. Subclasses have `work(context)`, which returns the line to report; what it raises
    as MeshProblem is reported, with nothing changed."""

    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context):
        try:
            text = self.work(context)
        except mesh_io.MeshProblem as problem:
            errors.complain(self, str(problem))
            return {"CANCELLED"}
        self.report({"INFO"}, text)
        return {"FINISHED"}


def read_meshes(context, *, use_modifiers=False):
    """reading_meshes(), all at once."""
    return steps.result_of(reading_meshes(context, use_modifiers=use_modifiers))


def reading_meshes(context, *, use_modifiers=False):
    """Snapshots of the faces to work on, and failures (errors.Failure) of objects that cannot be read: in edit mode the selected
    faces, in object mode all but hidden ones. Objects without such faces are passed over as long as one other has some. Raises
    MeshProblem if nothing is left at all. A generator, in steps between which a window goes on."""
    editing = context.mode == "EDIT_MESH"
    in_uv_editor = context.area is not None and context.area.type == "IMAGE_EDITOR"
    uv_selection = editing and in_uv_editor and not context.tool_settings.use_uv_select_sync
    snapshots, unselected = [], None
    failures = refused(context)
    for ob in meshes(context):
        if not watch.is_there(ob):  # since the step before
            continue
        try:
            snapshot = yield from mesh_io.reading(
                ob,
                only_selected=editing,
                uv_selection=uv_selection,
                only_visible=not editing,
                use_modifiers=use_modifiers,
            )
            snapshots.append(snapshot)
        except mesh_io.NothingSelected as problem:
            unselected = unselected or problem
        except mesh_io.MeshProblem as problem:
            failures.append(errors.from_problem(ob.name, problem))
        yield
    if not snapshots and not failures:
        raise unselected or mesh_io.MeshProblem("Select a mesh object")
    return snapshots, failures


def whole_objects(context, make_task, *, wanted=lambda ob: True) -> tuple[list, list]:
    """(tasks, failures) for all faces of each object that has a map and is wanted: make_task(snapshot, object)."""
    tasks, failures = [], []
    for ob in meshes(context):
        if ob.data.uv_layers.active is None or not wanted(ob):
            continue
        try:
            tasks.append(make_task(mesh_io.read(ob, only_selected=False), ob))
        except mesh_io.MeshProblem as problem:
            failures.append(errors.from_problem(ob.name, problem))
    return tasks, failures


def pins_of(snapshot: mesh_io.Snapshot) -> dict:
    """Pinned UVs as {(triangle, corner): (u, v)}. Raises MeshProblem if one is no number."""
    if not snapshot.pinned.any():
        return {}
    pinned = snapshot.pinned[snapshot.triangle_loops]
    rows, corners = np.nonzero(pinned)
    values = snapshot.corner_uv[rows, corners].astype(np.float64)
    bad = ~np.isfinite(values).all(axis=1)
    if bad.any():
        why = "has a pinned UV that is no number. Unpin it with Alt P"
        raise mesh_io.at_faces(snapshot, rows[bad], why)
    keys = zip(rows.tolist(), corners.tolist(), strict=True)
    return dict(zip(keys, map(tuple, values.tolist()), strict=True))


def refuse_nonfinite_uvs(snapshot: mesh_io.Snapshot) -> None:
    """Raises MeshProblem naming the faces with a UV that is no number."""
    bad = ~np.isfinite(snapshot.corner_uv).all(axis=(1, 2))
    if bad.any():
        raise mesh_io.at_faces(snapshot, bad, "has a UV that is no number. Unwrap it again")


def refuse_uncertified(snapshot: mesh_io.Snapshot, certificate) -> None:
    """The solver returns nothing without a valid certificate; what is written is judged here all the same. Raises
    MeshProblem."""
    if not certificate.ok:
        raise mesh_io.MeshProblem(
            f"{snapshot.object_name}: the map failed its check: {'; '.join(certificate.failures)}"
        )


def plural(count: int, noun: str, many: str = "") -> str:
    """`many`: the noun for other numbers than one, if not with an s."""
    return f"{count} {noun}" if count == 1 else f"{count} {many or noun + 's'}"


def figures(tasks, island_overlaps: int | None = None) -> str:
    """The numbers of a report line: islands, flips, overlaps, distortion (1 = none).

    island_overlaps: pairs of islands on each other, where the certificates are those of parts and do not know.
    """
    certificates = [c for task in tasks for c in task.certificates]
    islands = sum(task.island_count() for task in tasks)
    flips = sum(max(c.flips32, 0) for c in certificates)
    triangles = sum(c.triangles for c in certificates)
    known = [c for c in certificates if math.isfinite(c.energy) and c.energy >= 0]
    if island_overlaps is None:
        island_overlaps = sum(max(c.island_overlaps, 0) for c in certificates)
    turned = sum(c.turned for c in certificates)
    parts = [plural(islands, "island"), plural(flips, "flip")]
    if turned:
        parts.append(f"{plural(turned, 'face')} turned over")
    mirrored = sum(c.mirrored_islands for c in certificates)
    if mirrored:
        parts.append(texts.mirrored(mirrored))
    own = sum(max(c.overlaps, 0) for c in certificates)
    uncounted = any(c.overlaps < 0 < max(c.flips64, c.flips32) for c in certificates)
    if own or island_overlaps or not uncounted:
        parts.append(overlaps_text(own, island_overlaps))
    if uncounted:
        parts.append("overlaps of islands with themselves not counted where a map has flips")
    if known:
        mean = by_area(known, "energy")
        worst = max(c.max_energy for c in known)
        parts.append(f"distortion mean {mean:.3f} max {worst:.3g}")
    return f"{', '.join(parts)} on {plural(triangles, 'triangle')}{separated_text(certificates, False)}"


def by_area(certificates, name: str) -> float | None:
    """Mean of a figure over the surface of all certificates that have it; None if none has."""
    known = [(getattr(c, name), c.area) for c in certificates]
    known = [(value, area) for value, area in known if math.isfinite(value) and value >= 0.0]
    whole = sum(area for _, area in known)
    if not known:
        return None
    if not 0.0 < whole < math.inf:
        return max(value for value, _ in known)
    return sum(value * area for value, area in known) / whole


def separated_text(certificates, turned: bool = True) -> str:
    """What meshes were separated for, as the end of a report's figures; "" if all were clean. turned: turned faces, too."""
    mended = mends(certificates)
    if not turned:
        mended.pop(results.TURNED, None)
    if not mended:
        return ""
    return "; separated: " + ", ".join(texts.mended(count, what) for what, count in mended.items())


def mends(certificates) -> dict[str, int]:
    """What meshes that are no clean surface were separated for, and how often."""
    found: dict[str, int] = {}
    for certificate in certificates:
        for mend in certificate.mends:
            found[mend.what] = found.get(mend.what, 0) + mend.count
    return found


def own_overlaps(task) -> int:
    """Pairs of islands on each other within one object."""
    if hasattr(task, "island_overlaps"):  # of the parts together
        return max(task.island_overlaps, 0)
    return sum(max(c.island_overlaps, 0) for c in task.certificates)


def between_text(tasks) -> str:
    """What lies on what among the objects of a run, as the end of a report's figures; "" for one object."""
    mapped = [task for task in tasks if task.judged]
    if len(mapped) < 2:
        return ""
    pairs = max(task.object_overlaps for task in mapped)
    if pairs < 0:
        return ", overlaps between objects not counted"
    if pairs == 0:
        return ""
    return ", " + plural(pairs, "pair") + " of islands of different objects on each other"


def texture_text(aspect: float) -> str:
    """For which texture a map was made or measured, as the end of a report's figures; "" for a square."""
    return "" if aspect == 1.0 else f", for a texture {aspect:.4g} times as wide as high"


def overlaps_text(own: int, between: int) -> str:
    """own: places where an island overlaps itself; between: pairs of islands that share area."""
    texts = [plural(own, "overlap")] if own or not between else []
    if between:
        texts.append(
            "1 pair of islands overlaps" if between == 1 else f"{between} pairs of islands overlap"
        )
    return ", ".join(texts)


def poor_islands(tasks) -> list[int]:
    """Mesh faces, one of each island that is distorted beyond the bound; the worst of each map first."""
    return [
        int(judged.faces[face])
        for task in tasks
        for judged in task.judged
        for face in judged.certificate.poor_islands.tolist()
    ]


# What to do about distorted islands, unless a task knows better (`poor_cure`).
MORE_SEAMS = "Mark more seams there"


def advice(tasks) -> str:
    """What to do about poor maps among `tasks`, about boundaries that are not as they were asked for, and about objects whose
    scale the maps know nothing of; "" if all is well."""
    about = (_about_poor, _about_turned, _about_freed, _about_enlarged, _about_scale)
    return ". ".join(filter(None, (say(tasks) for say in about)))


def _about_turned(tasks) -> str:
    turned = sum(c.turned for task in tasks for c in task.certificates)
    cure = "Recalculate normals (Mesh > Normals > Recalculate Outside)"
    return f"{texts.turned_over(turned)}. {cure}" if turned else ""


def _about_freed(tasks) -> str:
    freed = sum(getattr(task, "freed_boundaries", 0) for task in tasks)
    if not freed:
        return ""
    have = "has" if freed == 1 else "have"
    return (
        f"{plural(freed, 'part')} {have} a free boundary: no map was found with one along the axes. Where that "
        "matters, mark its corners with Mark Cone"
    )


def _about_enlarged(tasks) -> str:
    enlarged = sum(getattr(task, "enlarged_islands", 0) for task in tasks)
    if not enlarged:
        return ""
    was, now = ("was", "is") if enlarged == 1 else ("were", "are")
    return f"{plural(enlarged, 'part')} {was} too small beside the others for 32 bits, and {now} larger than in scale"


def _about_scale(tasks) -> str:
    names = [task.snapshot.object_name for task in tasks if getattr(task, "flattens", False)]
    there = watch.objects_by_name() if names else {}
    found = [name for name in names if scene.uneven(there.get(name))]
    if not found:
        return ""
    return f"{found[0]}{mesh_io.more(found)} has a non-uniform scale: apply it (Ctrl A) if the islands should not be stretched"


def needles_hint(tasks) -> str:
    return texts.needles_named(sum(c.needles for task in tasks for c in task.certificates))


def _about_poor(tasks) -> str:
    poor = [task for task in tasks if any(c.poor for c in task.certificates)]
    if not poor:
        return ""
    cure = getattr(poor[0], "poor_cure", MORE_SEAMS)
    found = poor_islands(tasks)
    share = by_area([c for task in tasks for c in task.certificates], "stretched")
    text = texts.above_bound(share or 0.0)
    if not found:
        return f"{text[0].upper()}{text[1:]}. {cure}"
    refined = any(getattr(task, "new_vertices", 0) for task in tasks)
    where = "" if refined else f", the worst at face {found[0]}"  # new faces shift the ids
    return (
        f"{text[0].upper()}{text[1:]}: {plural(len(found), 'island')}{where}. {cure}: "
        "Flipfree > Select Stretched Islands selects them"
    )
