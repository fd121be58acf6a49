"""Everything that Blender makes, unwrapped by Blender and by us: who maps how many triangles, flips, overlaps.

Inside a Blender whose profile has the extension (scripts/blender-tests.sh makes one):

    BLENDER_USER_RESOURCES=build/profile-blender-4.3 build/blender-4.3/blender -b --python benchmarks/blender_objects.py

Judged by `judges.any_triangles` and `judges.coverage`, which share no code with ours. Seams: none, as a beginner would do it.
A triangle counts as mapped if it has an area in the map; an edge as folded if two triangles of one island lie on its same side.
"""

import re
import sys
from pathlib import Path

import bpy
import numpy as np

ROOT = Path(__file__).resolve().parent.parent
for folder in ("tests", "tests/python", "tests/blender", "benchmarks"):
    sys.path.append(str(ROOT / folder))

import shapes  # noqa: E402
from all_objects import OBJECTS  # noqa: E402

from judges.any_triangles import judge_any  # noqa: E402
from judges.coverage import overlapping_triangles  # noqa: E402
from judges.exact import turns  # noqa: E402

METHODS = ("ANGLE_BASED", "CONFORMAL", "MINIMUM_STRETCH")


def judged(ob) -> tuple[int, int, int, int]:
    """Triangles, those mapped, folded edges, pairs that overlap."""
    triangles, uv = shapes.triangles_of(ob)
    points = uv.astype(np.float64)
    side = turns(points[:, 0], points[:, 1], points[:, 2])
    text = " ".join(judge_any(triangles, uv, disjoint=False))
    folded = re.search(r"(\d+) edges with", text)
    pairs = overlapping_triangles(points, side.astype(np.int8))
    return len(triangles), int((side != 0).sum()), int(folded[1]) if folded else 0, len(pairs)


def by_blender(method: str) -> None:
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.reveal()
    bpy.ops.mesh.select_all(action="SELECT")
    bpy.ops.uv.unwrap(method=method, margin=0.005)
    bpy.ops.object.mode_set(mode="OBJECT")


def main() -> None:
    makers = {f"Blender {method}": lambda m=method: by_blender(m) for method in METHODS}
    makers["Flipfree UV"] = bpy.ops.uv.flipfree_unwrap
    rows = [
        "| object | triangles | " + " | ".join(makers) + " |",
        "|---|---|" + "---|" * len(makers),
    ]
    total = {name: [0, 0, 0] for name in makers}
    for name, make in OBJECTS.items():
        cells, count = [], 0
        for maker, unwrap in makers.items():
            for collection in (bpy.data.objects, bpy.data.meshes):
                bpy.data.batch_remove(list(collection))
            make()
            ob = bpy.context.object
            if ob.data.uv_layers.active is None:
                ob.data.uv_layers.new()
            unwrap()
            count, *figures = judged(ob)
            total[maker] = [a + b for a, b in zip(total[maker], figures, strict=True)]
            cells.append("{} / {} / {}".format(*figures))
        rows.append(f"| {name} | {count} | " + " | ".join(cells) + " |")
    sums = ["{} / {} / {}".format(*figures) for figures in total.values()]
    rows.append("| all | | " + " | ".join(sums) + " |")
    print("Triangles mapped / edges folded / pairs of triangles that overlap\n")
    print("\n".join(rows))


main()
