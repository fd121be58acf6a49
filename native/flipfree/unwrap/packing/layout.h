// Turning and moving charts in UV space.
#pragma once

#include <vector>

#include "flipfree/base/types.h"

namespace flipfree::unwrap {

// Turns the map to the smallest rectangle that bounds it (by CGAL, of the convex hull),
// wider than high, with its lower left corner at the origin.
void turn_to_smallest_rectangle(Points2& uv);

// With u negated.
Points2 mirror_image(const Points2& uv);

// The rows of all parts.
Points2 below_each_other(const std::vector<Points2>& parts);

// The map (#V x 2) corner by corner, 3 #F x 2.
Points2 by_corner(const Triangles& faces, const Points2& uv);

}  // namespace flipfree::unwrap
