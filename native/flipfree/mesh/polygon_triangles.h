// Polygons of a file as triangles that lie where the polygon lies, concave ones too.
#pragma once

#include <array>
#include <vector>

#include "flipfree/base/types.h"

namespace flipfree::mesh {

using PolygonTriangle = std::array<Index, 3>;  // numbers of corners, in the polygon's winding

// n - 2 triangles of a polygon of n >= 3 corners in space, every side in one of them and every
// diagonal in two. Seen along the polygon's normal (by the sum of its sides' cross products, up to
// rounding where that is no axis) none is turned over, so that none leaves the polygon, wherever
// such triangles exist: for all outlines that do not cross themselves, holes by bridges and corners
// at one place included. Of several:
//   - the fan around corner 0, unless it is turned over or has a triangle without a shape
//     (kThinnest); quads as Blender splits them, by corners 0 and 2 unless that folds the quad;
//   - up to kFewAtBest, and up to kMostAtBest where the outline touches or crosses itself, the
//     triangles of least area in space, then the best shaped (Klincsek 1980);
//   - above, the constrained Delaunay triangulation seen along the normal.
// Larger outlines that touch or cross themselves lose ears until kMostAtBest are left. Corners at
// the place of the one before them get a triangle without area. Precondition: finite coordinates.
// Deterministic, the same for every power-of-two scale. Cost: O(n log n) as a rule, O(n^2) for
// outlines above kMostAtBest that touch or cross themselves, where beyond kMostByEars the fan
// stays.
inline constexpr std::size_t kFewAtBest = 24;
inline constexpr std::size_t kMostAtBest = 256;
inline constexpr std::size_t kMostByEars = 20000;
std::vector<PolygonTriangle> triangles_of_polygon(const std::vector<Vector3>& corners);

}  // namespace flipfree::mesh
