// Closed polygons in the plane: turning number, simplicity, containment. All decided exactly.
//
// A polygon is its corners in order, the last one joined to the first. The surface lies on its
// left.
#pragma once

#include <optional>
#include <utility>
#include <vector>

#include "flipfree/base/types.h"

namespace flipfree::matchmaker {

using Polygon = std::vector<Vector2>;

// How many times the direction of travel turns counter-clockwise in one round: 1 for a simple
// counter-clockwise polygon, 0 for a figure-eight. A reversal (a spike, where the polygon goes back
// along itself) is the tip of a slit: its inner angle is 2 pi, so it turns right by pi.
// Precondition: consecutive corners differ. Cost: O(n).
int turning_number(const Polygon& polygon);

// Does it nowhere turn right? Convex polygons are so, and some that wind more than once. Cost:
// O(n).
bool is_locally_convex(const Polygon& polygon);

// Two edges (numbered by their first corner) that meet where they must not, if there are any: the
// polygon is simple exactly if there are none. Cost: O(n log n + pairs of edges whose x-ranges
// overlap).
std::optional<std::pair<Index, Index>> first_conflict(const Polygon& polygon);

// Where a point lies: 1 strictly inside, 0 on the polygon, -1 outside (even-odd rule). Cost: O(n).
int locate_in_polygon(const Polygon& polygon, const Vector2& point);

// The weights of a point by the corners of a triangle that has an area. They sum to one.
Vector3 barycentric(const Vector2& a, const Vector2& b, const Vector2& c, const Vector2& point);

// One point per row.
Points2 rows_of(const Polygon& points);
// x0, y0, x1, y1, ..., as witnesses hold points.
std::vector<double> numbers_of(const Polygon& points);

}  // namespace flipfree::matchmaker
