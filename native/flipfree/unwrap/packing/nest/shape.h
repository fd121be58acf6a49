// What is packed: outlines in the plane that turn, move and grow as one.
#pragma once

#include <algorithm>
#include <vector>

#include "flipfree/base/types.h"

namespace flipfree::unwrap {

using Loop = std::vector<Vector2>;  // closed; what it bounds on the left

// One item about its own origin, at scale 1: the outlines of its islands, with fewer corners than
// they have. Points of which an outline winds around other than 0 times are inside.
struct Shape {
  std::vector<Loop> loops;
  // The islands reach at most so far beyond these loops (scale 1).
  double slack = 0.0;
  double area = 0.0;    // of the islands
  double radius = 0.0;  // the farthest corner from the origin
};

// Where an item lies: p -> scale turn p + centre, with one scale for all.
struct Pose {
  Vector2 centre = Vector2::Zero();
  Vector2 turn = Vector2(1.0, 0.0);  // cosine and sine
  Vector2 operator()(const Vector2& p, double scale) const {
    return {scale * (turn.x() * p.x() - turn.y() * p.y()) + centre.x(),
            scale * (turn.y() * p.x() + turn.x() * p.y()) + centre.y()};
  }
};

// Of a point from the segment from a to b, which may be a point.
inline double distance_to_segment(const Vector2& p, const Vector2& a, const Vector2& b) {
  const Vector2 side = b - a;
  const double square = side.squaredNorm();
  const double t = square > 0.0 ? std::clamp((p - a).dot(side) / square, 0.0, 1.0) : 0.0;
  return (p - a - t * side).norm();
}

// The loop with fewer corners, none of its points farther than `tolerance` from it (Douglas and
// Peucker); at least three corners if it has them. Cost: O(n log n) as a rule.
Loop simplified(const Loop& loop, double tolerance);

// A shape of these outlines, whose middle goes to the origin; `middle` receives where it was.
// Outlines that are no more than points get a corner each. Loops must be finite.
Shape make_shape(const std::vector<Loop>& outlines, double tolerance, Vector2& middle);

// Of outlines most of which runs in two directions at a right angle - rectangles, crosses, letters
// like E - the turn that brings these onto the axes, by half a quarter at most; (0, 0) of others.
Vector2 straight_axis(const std::vector<Loop>& outlines);
// The turn by less than a quarter after which the square around the shape, sides along the axes, is
// smallest, up to a quarter of a degree. Cost: 360 times the corners.
Vector2 squarest_turn(const Shape& shape);
// Do the shape's outlines run along the axes?
bool is_straight(const Shape& shape);

}  // namespace flipfree::unwrap
