// Turning and moving charts in UV space.
#pragma once

#include <vector>

#include "flipfree/base/types.h"

namespace flipfree::unwrap {

// The turn (cosine, sine) after which the smallest rectangle around the points (by CGAL, of the
// convex hull) lies along the axes, wider than high; (1, 0) where all are on a line.
Vector2 turn_to_smallest_rectangle(const Points2& points);

// With u negated.
Points2 mirror_image(const Points2& uv);

// The rows of all parts.
Points2 below_each_other(const std::vector<Points2>& parts);

// The map (#V x 2) corner by corner, 3 #F x 2.
Points2 by_corner(const Triangles& faces, const Points2& uv);

}  // namespace flipfree::unwrap
