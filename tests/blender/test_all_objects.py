# SPDX-License-Identifier: GPL-3.0-or-later
"""Whatever Blender makes, and whatever imports leave: every face is mapped from the menu, nothing flipped or covered twice."""

import bpy
import pytest
import shapes
from all_objects import OBJECTS

from judges.any_triangles import judge_any

pytestmark = pytest.mark.halved


@pytest.mark.parametrize("name", OBJECTS)
def test_every_face_gets_a_place_of_its_own(name):
    OBJECTS[name]()
    ob = bpy.context.object
    assert len(ob.data.polygons)
    assert bpy.ops.uv.flipfree_unwrap() == {"FINISHED"}
    triangles, uv = shapes.triangles_of(ob)
    assert judge_any(triangles, uv) == []
    assert bpy.ops.uv.flipfree_improve() == {"FINISHED"}
    assert judge_any(*shapes.triangles_of(ob), disjoint=False) == []
    assert bpy.ops.uv.flipfree_check() == {"FINISHED"}
