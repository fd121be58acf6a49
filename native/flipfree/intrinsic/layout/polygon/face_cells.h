// Triangulates the image of one input triangle by the cells that the final triangulation cuts it
// into, whatever it winds around.
//
// The vertices of T are those of the input, so inside an input triangle the edges of T are chords:
// from side to side around a corner, or, of one corner at most, to the side opposite to it. How
// many points each side has tells which chords these are (as normal coordinates do). Between two
// neighbouring chords lies a part of one triangle of T: convex, with three to six corners. So a
// face that is crossed a thousand times falls into small convex pieces, where a search among all
// diagonals (polygon_triangulation.h) takes its cube and one of ears may miss what there is.
#pragma once

#include <array>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/intrinsic/layout/polygon/polygon_triangulation.h"

namespace flipfree::intrinsic {

// Where a vertex of the polygon lies: 0 is the first corner of that side, 1 its first point.
struct SidePlace {
  Index side = 0;
  Index place = 0;
};

// Pairs (i, j), i < j, of positions in a polygon: the chords both of whose ends are there. `count`:
// points on each side, in use or not. Cost: O(polygon).
std::vector<std::array<Index, 2>> face_chords(const std::array<Index, 3>& count,
                                              const std::vector<SidePlace>& place);

// The polygon's triangles, each part between chords by itself; false if one of these has none.
// Chords do not cross. Where points of the polygon are not those of an overlay, or some are
// missing, triangles are valid all the same, but may wind otherwise. Cost: that of the parts.
bool triangulate_cells(const std::vector<PolygonVertex>& polygon,
                       const std::vector<std::array<Index, 2>>& chords, Storage storage,
                       std::vector<PolygonTriangle>& triangles, const ExecutionContext& context);

}  // namespace flipfree::intrinsic
