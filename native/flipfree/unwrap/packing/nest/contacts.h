// What is near what in a layout: corners of one shape and edges of another.
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/unwrap/packing/nest/shape.h"

namespace flipfree::unwrap {

// A corner of shape `a` near an edge or corner of shape `b`; kInvalid stands for what is fixed.
// Both points in the coordinates of their shape, or of the plane.
struct Contact {
  Index a = kInvalid;
  Index b = kInvalid;
  Vector2 corner = Vector2::Zero();
  Vector2 point = Vector2::Zero();  // of b, the nearest one
  Vector2 away = Vector2::Zero();   // unit, in the plane: where a is to go to leave b
  double gap = 0.0;                 // between the loops, negative for corners inside b
};

// All pairs with a gap of at most `reach`, one for each place where the distance from the corner is
// least, ordered by a's corners. `fixed`: loops in the plane, counter-clockwise. Cost: O(corners +
// pairs within reach).
std::vector<Contact> find_contacts(const std::vector<Shape>& shapes, const std::vector<Pose>& poses,
                                   double scale, const std::vector<Loop>& fixed, double reach,
                                   const ExecutionContext& context);

// Do outlines of different shapes, or of a shape and of what is fixed, cross? In floating point.
// Cost: O(corners + pairs of edges in the same small cells).
bool any_crossing(const std::vector<Shape>& shapes, const std::vector<Pose>& poses, double scale,
                  const std::vector<Loop>& fixed, const ExecutionContext& context);

}  // namespace flipfree::unwrap
