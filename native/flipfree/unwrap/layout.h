// Where charts go in UV space: turned to their smallest rectangle and set on shelves of the unit
// square.
#pragma once

#include <vector>

#include "flipfree/base/types.h"

namespace flipfree {

// Turns the map to the smallest rectangle that bounds it (rotating calipers on the convex hull),
// wider than high, with its lower left corner at the origin.
void turn_to_smallest_rectangle(Points2& uv);

struct Placement {
  std::vector<Vector2> offset;  // per rectangle, before scaling
  double scale = 1.0;           // common factor that makes everything fit [0, 1]^2
};

// Shelf packing of rectangles (width, height), highest first, with at least `margin`, in units of
// the final unit square, between them and around. A margin that leaves n rectangles no room is
// lowered to 0.9 / (sqrt(n) + 1). Deterministic; O(n log n).
Placement pack_rectangles(const std::vector<Vector2>& sizes, double margin);

// The similarity (rotation, uniform scale, translation; no reflection) that carries the points
// `from` to `to` best in the least-squares sense: w = a z + b over complex numbers. Identity scale
// if the points coincide.
struct Similarity {
  Vector2 linear = Vector2(1.0, 0.0);  // a = linear.x + i linear.y
  Vector2 translation = Vector2::Zero();
  Vector2 operator()(const Vector2& p) const {
    return {linear.x() * p.x() - linear.y() * p.y() + translation.x(),
            linear.y() * p.x() + linear.x() * p.y() + translation.y()};
  }
};
Similarity fit_similarity(const Points2& from, const Points2& to);

}  // namespace flipfree
